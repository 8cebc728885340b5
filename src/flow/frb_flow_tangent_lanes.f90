!> Blocks of equal bodies with their derivatives, one body per SIMD lane, in loops of fixed length that the
!> compiler vectorises. This module loads a block and combines states and derivatives from the parts that
!> frb_flow_tangent_near and frb_flow_tangent_far compute. The result of a body does not depend on the others
!> of its block. Each formula is called in one place: only then is it inlined.
!>
!> Components of the states are read and written in the caller's memory, each as an array with a constant
!> distance between bodies. So a block may have its axes in any order.
module frb_flow_tangent_lanes
    use frb_flow_limits, only: tiny_limit, short_limit, small_turn_limit, middle_limit, period_limit, &
        sin_cos_limit, plain_largest, plain_smallest
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: lanes, lane_body, lane_orbits, lane_ends, angle_as_reach
    public :: load_lanes, set_forms, is_served, keep_lanes, join_lanes, finish_lanes

    integer, parameter :: lanes = 32    !! bodies in a block
    real(wp), parameter :: angle_as_reach = short_limit/small_turn_limit
    real(wp), parameter :: no_reach = 1.0e300_wp    !! a lane that is not served
    !> From one component of m, of q, of transition in the first lane of a block to that in the last.
    integer, parameter :: of_m = 3*lanes - 2, of_q = 4*lanes - 3, of_phi = 36*lanes - 35

    !> The body in axes of cyclic order, the middle moment second, times t = h/2. Where the moments ascend in
    !> an odd order, these axes have them descend, and a, b, g are negative.
    type :: lane_body
        integer :: order(3)         !! its axes in those of the body
        real(wp) :: a, b, g         !! alpha t, beta t, gamma t
        real(wp) :: first, last     !! a1 t, a3 t
        real(wp) :: largest         !! the larger of their squares
    end type lane_body

    !> The constants of the motion, in the axes of the form that is taken: see step_parts.
    type :: lane_orbits
        logical :: all_tiny, all_short                          !! all lanes, in the angle about m too
        real(wp) :: reach(lanes), square(lanes)                 !! largest of p, r; half angle^2
        real(wp) :: m(lanes, 3)                                 !! momentum in cyclic axes
        real(wp) :: m1(lanes), m2(lanes), m3(lanes), gg(lanes)  !! momentum in axes of the form; |m|^2
        real(wp) :: p(lanes), r(lanes), nu(lanes)
        real(wp) :: side(lanes)                                 !! 1: first form, -1: its mirror image
        real(wp) :: a(lanes), g(lanes), rate(lanes)
    end type lane_orbits

    !> The parts of the steps from which the derivatives are formed: see tangent_formulas.inc.
    type :: lane_ends
        real(wp) :: e1(lanes), e2(lanes), e3(lanes)                 !! momentum at the end
        real(wp) :: w0(lanes), w1(lanes), w2(lanes), w3(lanes)      !! turn e z, less 1
        real(wp) :: d(lanes), x(lanes), yy(lanes)                   !! z ~ (d, 0, -x d, -yy)
        real(wp) :: r11(lanes), r12(lanes), r13(lanes), r22(lanes), r23(lanes), r33(lanes)      !! R(z)^T - 1
        real(wp) :: x1(lanes), x2(lanes), x3(lanes), y1(lanes), y2(lanes), y3(lanes)        !! K
        real(wp) :: t1(lanes), t2(lanes), t3(lanes)                 !! gradient of the shift of the time
        real(wp) :: f1(lanes), f2(lanes), f3(lanes)                 !! k m + g
        real(wp) :: sine(lanes), versine(lanes)                     !! sin theta/G, (1 - cos theta)/G^2
    end type lane_ends

contains

    !> Loads the momenta of a block, and finds how far their steps reach. Lanes whose numbers are not plain
    !> are not served.
    pure subroutine load_lanes(body, m1, m2, m3, q, it, near, far)
        type(lane_body), intent(in) :: body
        real(wp), intent(in) :: m1(of_m), m2(of_m), m3(of_m), q(4*lanes)
        type(lane_orbits), intent(inout) :: it
        integer, intent(out) :: near, far       !! lanes that the series and the doublings serve
        real(wp) :: n1, n2, n3, size_m, size_q, least, most, ab, ag, bg, gg, k, p, r, reach, square, largest
        integer(int64) :: served, series, tiny, short
        integer :: l

        ab = body%a*body%b
        ag = body%a*body%g
        bg = body%b*body%g
        largest = body%largest
        served = 0
        series = 0
        tiny = 0
        short = 0
        do l = 1, lanes
            n1 = m1(3*l - 2)
            n2 = m2(3*l - 2)
            n3 = m3(3*l - 2)
            size_m = 0.25_wp*abs(n1) + (0.25_wp*abs(n2) + 0.25_wp*abs(n3))
            size_q = (0.25_wp*abs(q(4*l - 3)) + 0.25_wp*abs(q(4*l - 2))) &
                     + (0.25_wp*abs(q(4*l - 1)) + 0.25_wp*abs(q(4*l)))
            size_m = merge(plain_largest, size_m, ieee_is_nan(size_m))      ! comparing a NaN raises a flag
            size_q = merge(plain_largest, size_q, ieee_is_nan(size_q))
            least = min(size_m, size_q)
            most = max(size_m, size_q)
            least = merge(least, 0.0_wp, most < plain_largest)
            n1 = merge(n1, 0.0_wp, least > plain_smallest)
            n2 = merge(n2, 0.0_wp, least > plain_smallest)
            n3 = merge(n3, 0.0_wp, least > plain_smallest)
            gg = n1*n1 + (n2*n2 + n3*n3)
            k = ag*(n2*n2)
            p = bg*(n1*n1) + k
            r = k + ab*(n3*n3)
            square = largest*gg
            reach = max(p, r)
            reach = merge(reach, no_reach, square <= sin_cos_limit**2)
            reach = merge(reach, no_reach, least > plain_smallest)
            it%m(l, 1) = n1
            it%m(l, 2) = n2
            it%m(l, 3) = n3
            it%reach(l) = reach
            it%square(l) = square
            most = max(reach, square*angle_as_reach)
            served = served + merge(1_int64, 0_int64, reach <= period_limit)
            series = series + merge(1_int64, 0_int64, reach <= middle_limit)
            tiny = tiny + merge(1_int64, 0_int64, most <= tiny_limit)
            short = short + merge(1_int64, 0_int64, most <= short_limit)
        end do
        near = int(series)
        far = int(served - series)
        it%all_tiny = tiny == lanes
        it%all_short = short == lanes
    end subroutine load_lanes

    !> The constants of the motion, each lane in the form with the smaller nu; see tangent_forms.inc. Lanes
    !> that are not served stand still, so that nothing overflows in them.
    pure subroutine set_forms(body, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(inout) :: it
        real(wp) :: n1, n2, n3, a, b, g, gg, p, r, nu, mirror, x, y, alpha, gamma, first, last
        integer :: l

        alpha = body%a
        gamma = body%g
        first = body%first
        last = -body%last
        do l = 1, lanes
            n1 = it%m(l, 1)
            n2 = it%m(l, 2)
            n3 = it%m(l, 3)
            n1 = merge(n1, 0.0_wp, it%reach(l) <= period_limit)
            n2 = merge(n2, 0.0_wp, it%reach(l) <= period_limit)
            n3 = merge(n3, 0.0_wp, it%reach(l) <= period_limit)
            call orbit_constants(alpha, body%b, gamma, 1.0_wp, n1, n2, n3, a, b, g, gg, p, r, nu, mirror)
            it%m2(l) = n2
            it%gg(l) = gg + merge(0.0_wp, 1.0_wp, it%reach(l) <= period_limit)
            it%nu(l) = min(nu, mirror)
            x = merge(n1, n3, nu <= mirror)
            y = merge(n3, n1, nu <= mirror)
            it%m1(l) = x
            it%m3(l) = y
            x = merge(p, r, nu <= mirror)
            y = merge(r, p, nu <= mirror)
            it%p(l) = x
            it%r(l) = y
            x = merge(alpha, gamma, nu <= mirror)
            y = merge(gamma, alpha, nu <= mirror)
            it%a(l) = x
            it%g(l) = y
            x = merge(first, last, nu <= mirror)
            y = merge(1.0_wp, -1.0_wp, nu <= mirror)
            it%rate(l) = x
            it%side(l) = y
        end do
    end subroutine set_forms

    !> Whether the step of a lane is served: by series up to middle_limit, then by doublings.
    elemental function is_served(reach) result(served)
        real(wp), intent(in) :: reach
        logical :: served

        served = reach <= period_limit
    end function is_served

    !> The lanes that reach from `least` to `most`; the others stand still.
    pure subroutine keep_lanes(least, most, it, kept)
        real(wp), intent(in) :: least, most
        type(lane_orbits), intent(in) :: it
        type(lane_orbits), intent(inout) :: kept
        real(wp) :: one
        integer :: l

        kept = it
        do l = 1, lanes
            one = merge(1.0_wp, 0.0_wp, it%reach(l) <= most)
            one = merge(one, 0.0_wp, it%reach(l) > least)
            kept%m1(l) = one*it%m1(l)
            kept%m2(l) = one*it%m2(l)
            kept%m3(l) = one*it%m3(l)
            kept%p(l) = one*it%p(l)
            kept%r(l) = one*it%r(l)
            kept%nu(l) = one*it%nu(l)
        end do
    end subroutine keep_lanes

    !> `far` in lanes that reach beyond the series, else `near`.
    pure subroutine join_lanes(reach, near, far, it)
        real(wp), intent(in) :: reach(lanes)
        type(lane_ends), intent(in) :: near, far
        type(lane_ends), intent(inout) :: it
        integer :: l

        do l = 1, lanes
            it%e1(l) = merge(far%e1(l), near%e1(l), reach(l) > middle_limit)
            it%e2(l) = merge(far%e2(l), near%e2(l), reach(l) > middle_limit)
            it%e3(l) = merge(far%e3(l), near%e3(l), reach(l) > middle_limit)
            it%w0(l) = merge(far%w0(l), near%w0(l), reach(l) > middle_limit)
            it%w1(l) = merge(far%w1(l), near%w1(l), reach(l) > middle_limit)
            it%w2(l) = merge(far%w2(l), near%w2(l), reach(l) > middle_limit)
            it%w3(l) = merge(far%w3(l), near%w3(l), reach(l) > middle_limit)
            it%d(l) = merge(far%d(l), near%d(l), reach(l) > middle_limit)
            it%x(l) = merge(far%x(l), near%x(l), reach(l) > middle_limit)
            it%yy(l) = merge(far%yy(l), near%yy(l), reach(l) > middle_limit)
            it%r11(l) = merge(far%r11(l), near%r11(l), reach(l) > middle_limit)
            it%r12(l) = merge(far%r12(l), near%r12(l), reach(l) > middle_limit)
            it%r13(l) = merge(far%r13(l), near%r13(l), reach(l) > middle_limit)
            it%r22(l) = merge(far%r22(l), near%r22(l), reach(l) > middle_limit)
            it%r23(l) = merge(far%r23(l), near%r23(l), reach(l) > middle_limit)
            it%r33(l) = merge(far%r33(l), near%r33(l), reach(l) > middle_limit)
            it%x1(l) = merge(far%x1(l), near%x1(l), reach(l) > middle_limit)
            it%x2(l) = merge(far%x2(l), near%x2(l), reach(l) > middle_limit)
            it%x3(l) = merge(far%x3(l), near%x3(l), reach(l) > middle_limit)
            it%y1(l) = merge(far%y1(l), near%y1(l), reach(l) > middle_limit)
            it%y2(l) = merge(far%y2(l), near%y2(l), reach(l) > middle_limit)
            it%y3(l) = merge(far%y3(l), near%y3(l), reach(l) > middle_limit)
            it%t1(l) = merge(far%t1(l), near%t1(l), reach(l) > middle_limit)
            it%t2(l) = merge(far%t2(l), near%t2(l), reach(l) > middle_limit)
            it%t3(l) = merge(far%t3(l), near%t3(l), reach(l) > middle_limit)
            it%f1(l) = merge(far%f1(l), near%f1(l), reach(l) > middle_limit)
            it%f2(l) = merge(far%f2(l), near%f2(l), reach(l) > middle_limit)
            it%f3(l) = merge(far%f3(l), near%f3(l), reach(l) > middle_limit)
            it%sine(l) = merge(far%sine(l), near%sine(l), reach(l) > middle_limit)
            it%versine(l) = merge(far%versine(l), near%versine(l), reach(l) > middle_limit)
        end do
    end subroutine join_lanes

    !> Advances m and q, and forms the derivatives; results of lanes that are not served have no meaning.
    pure subroutine finish_lanes(body, of, it, m, q, transition)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(lane_ends), intent(in) :: it
        real(wp), intent(inout) :: m(3*lanes), q(4*lanes), transition(36*lanes)
        integer :: j(3, 3), w(3, 3), e(3, 3), k

        do k = 1, 3
            j(:, k) = body%order + 6*(body%order(k) - 1)
        end do
        w = j + 3
        e = j + 21
        associate (phi => transition, o => body%order)
            call set_attitudes(of, it, q(1), q(1 + o(1)), q(1 + o(2)), q(1 + o(3)), &
                               phi(e(1, 1)), phi(e(2, 1)), phi(e(3, 1)), phi(e(1, 2)), phi(e(2, 2)), &
                               phi(e(3, 2)), phi(e(1, 3)), phi(e(2, 3)), phi(e(3, 3)))
            call set_jacobians(body%b, of, it, m(o(1)), m(o(2)), m(o(3)), &
                               phi(j(1, 1)), phi(j(2, 1)), phi(j(3, 1)), phi(j(1, 2)), phi(j(2, 2)), &
                               phi(j(3, 2)), phi(j(1, 3)), phi(j(2, 3)), phi(j(3, 3)))
            call set_turns(of, it, &
                           phi(w(1, 1)), phi(w(2, 1)), phi(w(3, 1)), phi(w(1, 2)), phi(w(2, 2)), &
                           phi(w(3, 2)), phi(w(1, 3)), phi(w(2, 3)), phi(w(3, 3)))
        end associate
    end subroutine finish_lanes

    !> Attitudes at the end, and E.
    pure subroutine set_attitudes(of, it, a0, a1, a2, a3, t11, t21, t31, t12, t22, t32, t13, t23, t33)
        type(lane_orbits), intent(in) :: of
        type(lane_ends), intent(in) :: it
        real(wp), intent(inout), dimension(of_q) :: a0, a1, a2, a3
        real(wp), intent(inout), dimension(of_phi) :: t11, t21, t31, t12, t22, t32, t13, t23, t33
        real(wp) :: w0, w1, w2, w3, q0, q1, q2, q3, u1, u3
        real(wp) :: e11, e12, e13, e21, e22, e23, e31, e32, e33
        logical :: first
        integer :: l

        do l = 1, lanes
            w0 = it%w0(l)
            w1 = it%w1(l)
            w2 = it%w2(l)
            w3 = it%w3(l)
            call small_turn_matrix(w0, w1, w2, w3, e11, e12, e13, e21, e22, e23, e31, e32, e33)
            first = of%side(l) > 0.0_wp
            ! The turn in cyclic axes: in the mirror form it has the other sign.
            u1 = merge(w1, -w3, first)
            u3 = merge(w3, -w1, first)
            q0 = a0(4*l - 3)
            q1 = a1(4*l - 3)
            q2 = a2(4*l - 3)
            q3 = a3(4*l - 3)
            call turn(w0, u1, of%side(l)*w2, u3, q0, q1, q2, q3)
            a0(4*l - 3) = q0
            a1(4*l - 3) = q1
            a2(4*l - 3) = q2
            a3(4*l - 3) = q3
            t11(36*l - 35) = merge(e11, e33, first)
            t21(36*l - 35) = merge(e21, e23, first)
            t31(36*l - 35) = merge(e31, e13, first)
            t12(36*l - 35) = merge(e12, e32, first)
            t22(36*l - 35) = e22
            t32(36*l - 35) = merge(e32, e12, first)
            t13(36*l - 35) = merge(e13, e31, first)
            t23(36*l - 35) = merge(e23, e21, first)
            t33(36*l - 35) = merge(e33, e11, first)
        end do
    end subroutine set_attitudes

    !> J, and the momenta at the end.
    pure subroutine set_jacobians(b, of, it, n1, n2, n3, t11, t21, t31, t12, t22, t32, t13, t23, t33)
        real(wp), intent(in) :: b
        type(lane_orbits), intent(in) :: of
        type(lane_ends), intent(in) :: it
        real(wp), intent(inout), dimension(of_m) :: n1, n2, n3
        real(wp), intent(inout), dimension(of_phi) :: t11, t21, t31, t12, t22, t32, t13, t23, t33
        real(wp) :: j11, j12, j13, j21, j22, j23, j31, j32, j33, e1, e2, e3
        logical :: first
        integer :: l

        do l = 1, lanes
            e1 = it%e1(l)
            e2 = it%e2(l)
            e3 = it%e3(l)
            call tangent_of_momentum(it%d(l), it%x(l), it%yy(l), it%r11(l), it%r12(l), it%r13(l), it%r22(l), &
                                     it%r23(l), it%r33(l), it%x1(l), it%x2(l), it%x3(l), it%y1(l), it%y2(l), &
                                     it%y3(l), e1, e2, e3, j11, j12, j13, j21, j22, j23, j31, j32, j33)
            call add_product(-2*of%a(l)*(e2*e3), 2*b*(e3*e1), -2*of%g(l)*(e1*e2), it%t1(l), it%t2(l), &
                             it%t3(l), j11, j12, j13, j21, j22, j23, j31, j32, j33)
            first = of%side(l) > 0.0_wp
            n1(3*l - 2) = merge(e1, e3, first)
            n2(3*l - 2) = e2
            n3(3*l - 2) = merge(e3, e1, first)
            t11(36*l - 35) = merge(j11, j33, first)
            t21(36*l - 35) = merge(j21, j23, first)
            t31(36*l - 35) = merge(j31, j13, first)
            t12(36*l - 35) = merge(j12, j32, first)
            t22(36*l - 35) = j22
            t32(36*l - 35) = merge(j32, j12, first)
            t13(36*l - 35) = merge(j13, j31, first)
            t23(36*l - 35) = merge(j23, j21, first)
            t33(36*l - 35) = merge(j33, j11, first)
        end do
    end subroutine set_jacobians

    !> W, the derivative of the attitude by the momentum.
    pure subroutine set_turns(of, it, t11, t21, t31, t12, t22, t32, t13, t23, t33)
        type(lane_orbits), intent(in) :: of
        type(lane_ends), intent(in) :: it
        real(wp), intent(inout), dimension(of_phi) :: t11, t21, t31, t12, t22, t32, t13, t23, t33
        real(wp) :: w11, w12, w13, w21, w22, w23, w31, w32, w33, shift
        logical :: first
        integer :: l

        do l = 1, lanes
            call tangent_of_attitude(of%side(l), it%d(l), it%x(l), it%yy(l), it%r11(l), it%r12(l), &
                                     it%r13(l), it%r22(l), it%r23(l), it%r33(l), it%x1(l), it%x2(l), &
                                     it%x3(l), it%y1(l), it%y2(l), it%y3(l), it%e1(l), it%e2(l), it%e3(l), &
                                     of%m1(l), of%m2(l), of%m3(l), it%sine(l), it%versine(l), it%f1(l), &
                                     it%f2(l), it%f3(l), w11, w12, w13, w21, w22, w23, w31, w32, w33)
            shift = 2*of%side(l)*(of%g(l)*it%e1(l))
            w11 = w11 + shift*it%t1(l)
            w12 = w12 + shift*it%t2(l)
            w13 = w13 + shift*it%t3(l)
            shift = -2*of%side(l)*(of%a(l)*it%e3(l))
            w31 = w31 + shift*it%t1(l)
            w32 = w32 + shift*it%t2(l)
            w33 = w33 + shift*it%t3(l)
            first = of%side(l) > 0.0_wp
            t11(36*l - 35) = merge(w11, w33, first)
            t21(36*l - 35) = merge(w21, w23, first)
            t31(36*l - 35) = merge(w31, w13, first)
            t12(36*l - 35) = merge(w12, w32, first)
            t22(36*l - 35) = w22
            t32(36*l - 35) = merge(w32, w12, first)
            t13(36*l - 35) = merge(w13, w31, first)
            t23(36*l - 35) = merge(w23, w21, first)
            t33(36*l - 35) = merge(w33, w11, first)
        end do
    end subroutine set_turns

    include 'orbit_formulas.inc'

    include 'turn_formulas.inc'

    include 'tangent_formulas.inc'

    include 'tangent_product_formulas.inc'

end module frb_flow_tangent_lanes
