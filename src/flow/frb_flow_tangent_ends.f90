!> Longer steps of a block of bodies: the form of each lane before the doublings of frb_flow_tangent_far, and
!> states and derivatives from the parts that they find.
module frb_flow_tangent_ends
    use frb_flow_tangent_lanes, only: lanes, of_m, of_q, lane_body, lane_orbits
    use frb_kinds, only: wp
    implicit none
    private

    public :: lane_forms, lane_ends, set_forms, finish_lanes

    !> The constants of the motion, in the axes of the form that is taken: see step_parts.
    type :: lane_forms
        real(wp) :: m1(lanes), m2(lanes), m3(lanes), gg(lanes)  !! momentum at the start; |m|^2
        real(wp) :: p(lanes), r(lanes), nu(lanes)
        real(wp) :: side(lanes)                                 !! 1: first form, -1: its mirror image
        real(wp) :: a(lanes), g(lanes), rate(lanes)
    end type lane_forms

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

    !> The constants of the motion, each lane in the form with the smaller nu; see step_parts.
    pure subroutine set_forms(body, of, it)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: of
        type(lane_forms), intent(inout) :: it
        real(wp) :: n1, n2, n3, a, b, g, gg, p, r, nu, mirror, x, y, alpha, gamma, first, last
        integer :: l

        alpha = body%a
        gamma = body%g
        first = body%first
        last = -body%last
        do l = 1, lanes
            n1 = of%m1(l)
            n2 = of%m2(l)
            n3 = of%m3(l)
            call orbit_constants(alpha, body%b, gamma, 1.0_wp, n1, n2, n3, a, b, g, gg, p, r, nu, mirror)
            it%m2(l) = n2
            it%gg(l) = gg + merge(0.0_wp, 1.0_wp, gg > 0)       ! lanes that stand still
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

    !> Advances m and q, and forms the derivatives; results of lanes that are not served have no meaning.
    pure subroutine finish_lanes(body, orbits, of, it, m, q, transition)
        type(lane_body), intent(in) :: body
        type(lane_orbits), intent(in) :: orbits
        type(lane_forms), intent(in) :: of
        type(lane_ends), intent(in) :: it
        real(wp), intent(inout) :: m(3*lanes), q(4*lanes), transition(36*lanes)
        real(wp) :: x(lanes, 9)
        integer :: place(9), k

        do k = 1, 3
            place(3*k - 2:3*k) = body%order + 6*(body%order(k) - 1)
        end do
        associate (o => body%order)
            call set_attitudes(of, it, orbits%q(:, 1), orbits%q(:, 1 + o(1)), orbits%q(:, 1 + o(2)), &
                               orbits%q(:, 1 + o(3)), q(1), q(1 + o(1)), q(1 + o(2)), q(1 + o(3)), x)
            call put_matrices(of%side, x, place + 21, transition)
            call set_jacobians(body%b, of, it, m(o(1)), m(o(2)), m(o(3)), x)
            call put_matrices(of%side, x, place, transition)
            call set_turns(of, it, x)
            call put_matrices(of%side, x, place + 3, transition)
        end associate
    end subroutine finish_lanes

    !> Stores matrices, which are in the axes of the forms and have their columns one after another.
    pure subroutine put_matrices(side, x, place, transition)
        real(wp), intent(in) :: side(lanes), x(lanes, 9)
        integer, intent(in) :: place(9)         !! of the elements in the first transition
        real(wp), intent(inout) :: transition(36*lanes)
        integer :: k, l

        do k = 1, 9
            do l = 1, lanes
                ! The mirror form has the axes (3, 2, 1).
                transition(36*(l - 1) + place(k)) = merge(x(l, k), x(l, 10 - k), side(l) > 0.0_wp)
            end do
        end do
    end subroutine put_matrices

    !> Attitudes at the end, and E.
    pure subroutine set_attitudes(of, it, b0, b1, b2, b3, a0, a1, a2, a3, x)
        type(lane_forms), intent(in) :: of
        type(lane_ends), intent(in) :: it
        real(wp), intent(in), dimension(lanes) :: b0, b1, b2, b3        !! at the start
        real(wp), intent(inout), dimension(of_q) :: a0, a1, a2, a3
        real(wp), intent(inout) :: x(lanes, 9)
        real(wp) :: w1, w3, q0, q1, q2, q3, u1, u3
        logical :: first
        integer :: l

        do l = 1, lanes
            w1 = it%w1(l)
            w3 = it%w3(l)
            call small_turn_matrix(it%w0(l), w1, it%w2(l), w3, x(l, 1), x(l, 4), x(l, 7), x(l, 2), x(l, 5), &
                                   x(l, 8), x(l, 3), x(l, 6), x(l, 9))
            first = of%side(l) > 0.0_wp
            ! The turn in cyclic axes: in the mirror form it has the other sign.
            u1 = merge(w1, -w3, first)
            u3 = merge(w3, -w1, first)
            q0 = b0(l)
            q1 = b1(l)
            q2 = b2(l)
            q3 = b3(l)
            call turn(it%w0(l), u1, of%side(l)*it%w2(l), u3, q0, q1, q2, q3)
            include 'put_attitude.inc'
        end do
    end subroutine set_attitudes

    !> J, and the momenta at the end.
    pure subroutine set_jacobians(b, of, it, n1, n2, n3, x)
        real(wp), intent(in) :: b
        type(lane_forms), intent(in) :: of
        type(lane_ends), intent(in) :: it
        real(wp), intent(inout), dimension(of_m) :: n1, n2, n3
        real(wp), intent(inout) :: x(lanes, 9)
        real(wp) :: e1, e2, e3
        logical :: first
        integer :: l

        do l = 1, lanes
            e1 = it%e1(l)
            e2 = it%e2(l)
            e3 = it%e3(l)
            call tangent_of_momentum(it%d(l), it%x(l), it%yy(l), it%r11(l), it%r12(l), it%r13(l), it%r22(l), &
                                     it%r23(l), it%r33(l), it%x1(l), it%x2(l), it%x3(l), it%y1(l), it%y2(l), &
                                     it%y3(l), e1, e2, e3, x(l, 1), x(l, 4), x(l, 7), x(l, 2), x(l, 5), &
                                     x(l, 8), x(l, 3), x(l, 6), x(l, 9))
            first = of%side(l) > 0.0_wp
            n1(3*l - 2) = merge(e1, e3, first)
            n2(3*l - 2) = e2
            n3(3*l - 2) = merge(e3, e1, first)
        end do
        do l = 1, lanes
            e1 = it%e1(l)
            e2 = it%e2(l)
            e3 = it%e3(l)
            call add_product(-2*of%a(l)*(e2*e3), 2*b*(e3*e1), -2*of%g(l)*(e1*e2), it%t1(l), it%t2(l), &
                             it%t3(l), x(l, 1), x(l, 4), x(l, 7), x(l, 2), x(l, 5), x(l, 8), x(l, 3), &
                             x(l, 6), x(l, 9))
        end do
    end subroutine set_jacobians

    !> W, the derivative of the attitude by the momentum.
    pure subroutine set_turns(of, it, x)
        type(lane_forms), intent(in) :: of
        type(lane_ends), intent(in) :: it
        real(wp), intent(inout) :: x(lanes, 9)
        real(wp) :: first, third
        integer :: l

        do l = 1, lanes
            call tangent_of_attitude(of%side(l), it%d(l), it%x(l), it%yy(l), it%r11(l), it%r12(l), &
                                     it%r13(l), it%r22(l), it%r23(l), it%r33(l), it%x1(l), it%x2(l), &
                                     it%x3(l), it%y1(l), it%y2(l), it%y3(l), it%e1(l), it%e2(l), it%e3(l), &
                                     of%m1(l), of%m2(l), of%m3(l), it%sine(l), it%versine(l), it%f1(l), &
                                     it%f2(l), it%f3(l), x(l, 1), x(l, 4), x(l, 7), x(l, 2), x(l, 5), &
                                     x(l, 8), x(l, 3), x(l, 6), x(l, 9))
        end do
        do l = 1, lanes
            first = 2*of%side(l)*(of%g(l)*it%e1(l))
            third = -2*of%side(l)*(of%a(l)*it%e3(l))
            x(l, 1) = x(l, 1) + first*it%t1(l)
            x(l, 4) = x(l, 4) + first*it%t2(l)
            x(l, 7) = x(l, 7) + first*it%t3(l)
            x(l, 3) = x(l, 3) + third*it%t1(l)
            x(l, 6) = x(l, 6) + third*it%t2(l)
            x(l, 9) = x(l, 9) + third*it%t3(l)
        end do
    end subroutine set_turns

    include 'orbit_formulas.inc'

    include 'turn_formulas.inc'

    include 'tangent_formulas.inc'

    include 'tangent_product_formulas.inc'

end module frb_flow_tangent_ends
