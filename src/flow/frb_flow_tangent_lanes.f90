!> The free flow of a block of equal bodies with its derivative, one body per SIMD lane: the formulas of
!> frb_flow_tangent_one in loops of fixed length that the compiler vectorises, for steps that the series
!> reach, at any angle about m. What happens to a body depends on itself alone, not on the others of its
!> block. Each formula is called in one place: only then is it inlined.
module frb_flow_tangent_lanes
    use frb_flow_limits, only: tiny_limit, short_limit, small_turn_limit, middle_limit, sin_cos_limit
    use frb_kinds, only: wp
    implicit none
    private

    public :: lanes, tangent_lanes, step_lanes, is_served

    integer, parameter :: lanes = 32    !! bodies in a block

    !> A block in sorted axes, right-handed, and what its loops hand to one another.
    type :: tangent_lanes
        real(wp) :: m(lanes, 3), q(lanes, 0:3)
        real(wp) :: transition(lanes, 36)       !! columns one after another; those of zeros are the caller's
        real(wp) :: p(lanes), r(lanes), reach(lanes), &
            square(lanes) !! in the form taken; largest; half angle^2
        real(wp) :: side(lanes)                                     !! 1: first form, -1: its mirror image
        real(wp) :: a(lanes), g(lanes), m1(lanes), m3(lanes), gg(lanes), nu(lanes), rate(lanes)
        real(wp) :: y(lanes), scd(lanes), dd(lanes), aa(lanes), bb(lanes)
        real(wp) :: third(lanes), along(lanes), cosm1(lanes)        !! H; e is (1 + cosm1, along m)
        real(wp) :: m2(lanes), e1(lanes), e2(lanes), e3(lanes)      !! momentum at the end, axes of the form
        real(wp) :: v0(lanes), v2(lanes), v3(lanes), size(lanes), change(lanes), twice(lanes)
        real(wp) :: x(lanes), v(lanes), x1(lanes), x2(lanes), x3(lanes), y1(lanes), y2(lanes), y3(lanes)
        real(wp) :: f1(lanes), f2(lanes), f3(lanes)
        real(wp) :: r11(lanes), r12(lanes), r13(lanes), r22(lanes), r23(lanes), r33(lanes)
    end type tangent_lanes

contains

    !> Advances the lanes that are served by 2 t: m, q, and the derivatives; what the others hold afterwards
    !> means nothing. All lanes hold plain numbers, m and q not zero.
    pure subroutine step_lanes(alpha, beta, gamma, a1, a3, t, it)
        real(wp), intent(in) :: alpha, beta, gamma, a1, a3, t
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: reach

        call set_forms(alpha, beta, gamma, a1*t, a3*t, t, it)
        if (.not. all(is_served(it%reach, it%square))) call rest(it)
        reach = maxval(max(it%reach, it%square*(short_limit/small_turn_limit)))
        call tiny_parts(it)
        if (reach > tiny_limit) call short_parts(it)
        call small_angles(beta*t, it)
        if (reach > short_limit) call middle_parts(beta*t, it)
        call advance_momenta(beta*t, reach > short_limit, it)
        call advance_attitudes(it)
        call set_columns(beta*t, it)
        call set_jacobians(it)
        call set_turns(it)
    end subroutine step_lanes

    !> Whether the series reach the step of a lane.
    elemental function is_served(reach, square) result(served)
        real(wp), intent(in) :: reach, square
        logical :: served

        served = reach <= middle_limit .and. square <= sin_cos_limit**2
    end function is_served

    !> The constants of the motion, and each lane in the form with the smaller nu; see tangent_forms.inc.
    pure subroutine set_forms(alpha, beta, gamma, first, last, t, it)
        real(wp), intent(in) :: alpha, beta, gamma, first, last, t      !! first, last: a1 t, a3 t
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: a, b, g, p, r, nu, mirror
        integer :: l

        do l = 1, lanes
            call orbit_constants(alpha, beta, gamma, t, it%m(l, 1), it%m(l, 2), it%m(l, 3), a, b, g, &
                                 it%gg(l), &
                                 p, r, nu, mirror)
            it%reach(l) = max(p, r)
            it%square(l) = first*first*it%gg(l)
            it%side(l) = merge(1.0_wp, -1.0_wp, nu <= mirror)
            it%nu(l) = min(nu, mirror)
            it%p(l) = merge(p, r, nu <= mirror)
            it%r(l) = merge(r, p, nu <= mirror)
            it%a(l) = merge(a, g, nu <= mirror)
            it%g(l) = merge(g, a, nu <= mirror)
            it%m1(l) = merge(it%m(l, 1), it%m(l, 3), nu <= mirror)
            it%m3(l) = merge(it%m(l, 3), it%m(l, 1), nu <= mirror)
            it%rate(l) = merge(first, -last, nu <= mirror)
        end do
    end subroutine set_forms

    !> Lanes that are not served stand still, so that nothing overflows in them.
    pure subroutine rest(it)
        type(tangent_lanes), intent(inout) :: it
        logical :: served
        integer :: l

        do l = 1, lanes
            served = is_served(it%reach(l), it%square(l))
            it%p(l) = merge(it%p(l), 0.0_wp, served)
            it%r(l) = merge(it%r(l), 0.0_wp, served)
            it%nu(l) = merge(it%nu(l), 0.0_wp, served)
            it%rate(l) = merge(it%rate(l), 0.0_wp, served)
            it%m1(l) = merge(it%m1(l), 0.0_wp, served)
            it%m(l, 2) = merge(it%m(l, 2), 0.0_wp, served)
            it%m3(l) = merge(it%m3(l), 0.0_wp, served)
            it%gg(l) = merge(it%gg(l), 1.0_wp, served)
        end do
    end subroutine rest

    !> The triple and the integrals by the first terms of their series.
    pure subroutine tiny_parts(it)
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: p, r
        integer :: l

        do l = 1, lanes
            p = it%p(l)
            r = it%r(l)
            call tiny_series(p + r, p*r, it%y(l), it%scd(l))
            call tiny_integrals(p + r, p*r, p, r, it%dd(l), it%aa(l), it%bb(l))
            it%third(l) = tiny_third_kind(p + r, p*r, it%nu(l))
        end do
    end subroutine tiny_parts

    !> The same with all terms of short steps, for lanes that the first ones do not serve.
    pure subroutine short_parts(it)
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: p, r, y, scd, dd, aa, bb, third
        integer :: l

        do l = 1, lanes
            p = it%p(l)
            r = it%r(l)
            call short_series(p + r, p*r, y, scd)
            call short_integrals(p + r, p*r, p, r, dd, aa, bb)
            third = short_third_kind(p + r, p*r, it%nu(l))
            it%y(l) = merge(y, it%y(l), it%reach(l) > tiny_limit)
            it%scd(l) = merge(scd, it%scd(l), it%reach(l) > tiny_limit)
            it%dd(l) = merge(dd, it%dd(l), it%reach(l) > tiny_limit)
            it%aa(l) = merge(aa, it%aa(l), it%reach(l) > tiny_limit)
            it%bb(l) = merge(bb, it%bb(l), it%reach(l) > tiny_limit)
            it%third(l) = merge(third, it%third(l), it%reach(l) > tiny_limit)
        end do
    end subroutine short_parts

    !> The turn e of small angles.
    pure subroutine small_angles(b, it)
        real(wp), intent(in) :: b
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: angle
        integer :: l

        do l = 1, lanes
            angle = it%rate(l) - b*it%nu(l)*it%third(l)
            call small_turn(angle*angle*it%gg(l), it%along(l), it%cosm1(l))
            it%along(l) = angle*it%along(l)
        end do
    end subroutine small_angles

    !> Triple, integrals and turn of the lanes beyond, at any angle.
    pure subroutine middle_parts(b, it)
        real(wp), intent(in) :: b
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: p, r, y, scd, dd, aa, bb, angle, s3, norm, sine, half, sine_half
        logical :: beyond
        integer :: l

        do l = 1, lanes
            beyond = it%reach(l) > short_limit .or. it%square(l) > small_turn_limit
            p = min(it%p(l), middle_limit)
            r = min(it%r(l), middle_limit)
            call middle_series(p + r, p*r, y, scd)
            s3 = y*sqrt(y)
            call middle_integrals(p*y, r*y, dd, aa, bb)
            angle = it%rate(l) - b*it%nu(l)*(s3*middle_third_kind(p*y, r*y, it%nu(l)*y))
            ! 1 - cos x = 2 sin(x/2)^2 keeps its digits at small angles.
            norm = sqrt(it%gg(l))
            half = max(-sin_cos_limit, min(sin_cos_limit, 0.5_wp*angle*norm))
            call sin_cos(half, sine_half, sine)
            sine = 2*sine_half*sine
            it%y(l) = merge(y, it%y(l), beyond)
            it%scd(l) = merge(scd, it%scd(l), beyond)
            it%dd(l) = merge(s3*dd, it%dd(l), beyond)
            it%aa(l) = merge(s3*aa, it%aa(l), beyond)
            it%bb(l) = merge(s3*bb, it%bb(l), beyond)
            it%along(l) = merge(sine/norm, it%along(l), beyond)
            it%cosm1(l) = merge(-2*sine_half*sine_half, it%cosm1(l), beyond)
        end do
    end subroutine middle_parts

    !> Momentum at the end, and the direction (1 + v0, 0, v2, v3) of z.
    pure subroutine advance_momenta(b, any_middle, it)
        real(wp), intent(in) :: b
        logical, intent(in) :: any_middle
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: a, g, m1, m2, m3, k, d1, d2, d3, v0, v2, v3
        integer :: l

        do l = 1, lanes
            a = it%a(l)
            g = it%g(l)
            m1 = it%m1(l)
            m2 = it%m(l, 2)
            m3 = it%m3(l)
            k = a*g*(m2*m2)
            call short_momentum(it%p(l)*it%y(l), it%r(l)*it%y(l), k*(it%scd(l)*it%scd(l)), it%scd(l), m1, &
                                m2, &
                                m3, a*(m2*m3), b*(m3*m1), g*(m1*m2), d1, d2, d3)
            call short_direction(b, g, it%r(l)*it%y(l), k*it%y(l), it%y(l), it%scd(l), m2, m3, b*(m3*m1), &
                                 g*(m1*m2), v0, v2, v3)
            it%m2(l) = m2
            it%e1(l) = m1 + d1
            it%e2(l) = m2 + d2
            it%e3(l) = m3 + d3
            it%v0(l) = v0
            it%v2(l) = v2
            it%v3(l) = v3
            it%size(l) = (v0*(2 + v0) + v2*v2) + v3*v3
        end do
        do l = 1, lanes
            it%change(l) = short_norm(it%size(l))
        end do
        if (.not. any_middle) return
        do l = 1, lanes
            d1 = it%size(l)
            d2 = sqrt(1 + d1)
            it%change(l) = merge(-d1/(d2*(1 + d2)), it%change(l), it%reach(l) > short_limit)
        end do
    end subroutine advance_momenta

    !> Attitude at the end, and E.
    pure subroutine advance_attitudes(it)
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: v2, v3, w0, w1, w2, w3, z0, q1, q2, q3
        real(wp) :: e11, e12, e13, e21, e22, e23, e31, e32, e33
        logical :: first
        integer :: l

        do l = 1, lanes
            v2 = it%v2(l)
            v3 = it%v3(l)
            call join_turns(1 + it%cosm1(l), it%along(l), it%m1(l), it%m2(l), it%m3(l), 1 + it%v0(l), v2, &
                            v3, w1, &
                            w2, w3)
            call small_unit_turn(it%cosm1(l), it%v0(l), it%along(l)*(it%m2(l)*v2 + it%m3(l)*v3), &
                                 it%change(l), &
                                 w0, w1, w2, w3)
            call small_turn_matrix(w0, w1, w2, w3, e11, e12, e13, e21, e22, e23, e31, e32, e33)
            first = it%side(l) > 0.0_wp
            ! The turn in sorted axes: in the mirror form it has the other sign.
            q1 = merge(w1, -w3, first)
            q2 = it%side(l)*w2
            q3 = merge(w3, -w1, first)
            call turn(w0, q1, q2, q3, it%q(l, 0), it%q(l, 1), it%q(l, 2), it%q(l, 3))
            it%transition(l, 22) = merge(e11, e33, first)
            it%transition(l, 23) = merge(e21, e23, first)
            it%transition(l, 24) = merge(e31, e13, first)
            it%transition(l, 28) = merge(e12, e32, first)
            it%transition(l, 29) = e22
            it%transition(l, 30) = merge(e32, e12, first)
            it%transition(l, 34) = merge(e13, e31, first)
            it%transition(l, 35) = merge(e23, e21, first)
            it%transition(l, 36) = merge(e33, e11, first)
            z0 = (1 + it%v0(l))*(1 + it%change(l))
            it%twice(l) = 2*(z0*z0)
        end do
    end subroutine advance_attitudes

    !> What J and W have in common: R^T - 1 and the columns of K.
    pure subroutine set_columns(b, it)
        real(wp), intent(in) :: b
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: x, v, x1, x2, x3, y1, y2, y3, over_w, over_gg, twice, psi, k
        integer :: l

        do l = 1, lanes
            call short_gradients(it%a(l), b, it%g(l), it%m1(l), it%m2(l), it%m3(l), it%gg(l), it%p(l), &
                                 it%r(l), &
                                 it%nu(l), it%y(l), it%scd(l), it%aa(l), it%bb(l), x, v, x1, x2, x3, y1, y2, &
                                     y3, &
                                 over_w, over_gg)
            twice = it%twice(l)
            it%x(l) = x
            it%v(l) = v
            it%x1(l) = twice*x1
            it%x2(l) = twice*x2
            it%x3(l) = twice*x3
            it%y1(l) = twice*y1
            it%y2(l) = twice*y2
            it%y3(l) = twice*y3
            psi = -2*(b*it%g(l))*((it%dd(l) + (1 - it%r(l)*it%y(l))*it%bb(l))*over_w)
            k = 2*((it%rate(l) - it%along(l)*(1 + it%cosm1(l))) &
                   - (b*it%nu(l))*((1 - it%p(l)*it%y(l))*it%aa(l)*over_w))*over_gg
            it%f1(l) = k*it%m1(l)
            it%f2(l) = (k + psi*it%g(l))*it%m2(l)
            it%f3(l) = (k + psi*b)*it%m3(l)
            call turn_matrix(1.0_wp, x, v, twice, it%r11(l), it%r12(l), it%r13(l), it%r22(l), it%r23(l), &
                             it%r33(l))
        end do
    end subroutine set_columns

    !> J, and the momenta.
    pure subroutine set_jacobians(it)
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: j11, j12, j13, j21, j22, j23, j31, j32, j33
        logical :: first
        integer :: l

        do l = 1, lanes
            call tangent_of_momentum(1.0_wp, it%x(l), it%v(l), it%r11(l), it%r12(l), it%r13(l), it%r22(l), &
                                     it%r23(l), it%r33(l), it%x1(l), it%x2(l), it%x3(l), it%y1(l), it%y2(l), &
                                     it%y3(l), it%e1(l), it%e2(l), it%e3(l), &
                                     j11, j12, j13, j21, j22, j23, j31, j32, j33)
            first = it%side(l) > 0.0_wp
            it%m(l, 1) = merge(it%e1(l), it%e3(l), first)
            it%m(l, 2) = it%e2(l)
            it%m(l, 3) = merge(it%e3(l), it%e1(l), first)
            it%transition(l, 1) = merge(j11, j33, first)
            it%transition(l, 2) = merge(j21, j23, first)
            it%transition(l, 3) = merge(j31, j13, first)
            it%transition(l, 7) = merge(j12, j32, first)
            it%transition(l, 8) = j22
            it%transition(l, 9) = merge(j32, j12, first)
            it%transition(l, 13) = merge(j13, j31, first)
            it%transition(l, 14) = merge(j23, j21, first)
            it%transition(l, 15) = merge(j33, j11, first)
        end do
    end subroutine set_jacobians

    !> W.
    pure subroutine set_turns(it)
        type(tangent_lanes), intent(inout) :: it
        real(wp) :: w11, w12, w13, w21, w22, w23, w31, w32, w33, along
        logical :: first
        integer :: l

        do l = 1, lanes
            along = it%along(l)
            call tangent_of_attitude(it%side(l), 1.0_wp, it%x(l), it%v(l), it%r11(l), it%r12(l), it%r13(l), &
                                     it%r22(l), it%r23(l), it%r33(l), it%x1(l), it%x2(l), it%x3(l), &
                                         it%y1(l), &
                                     it%y2(l), it%y3(l), it%e1(l), it%e2(l), it%e3(l), it%m1(l), it%m2(l), &
                                     it%m3(l), 2*along*(1 + it%cosm1(l)), 2*along*along, it%f1(l), it%f2(l), &
                                     it%f3(l), w11, w12, w13, w21, w22, w23, w31, w32, w33)
            first = it%side(l) > 0.0_wp
            it%transition(l, 4) = merge(w11, w33, first)
            it%transition(l, 5) = merge(w21, w23, first)
            it%transition(l, 6) = merge(w31, w13, first)
            it%transition(l, 10) = merge(w12, w32, first)
            it%transition(l, 11) = w22
            it%transition(l, 12) = merge(w32, w12, first)
            it%transition(l, 16) = merge(w13, w31, first)
            it%transition(l, 17) = merge(w23, w21, first)
            it%transition(l, 18) = merge(w33, w11, first)
        end do
    end subroutine set_turns

    include 'orbit_formulas.inc'

    include 'series_formulas.inc'

    include 'tiny_formulas.inc'

    include 'short_formulas.inc'

    include 'unit_turn_formulas.inc'

    include 'middle_formulas.inc'

    include 'turn_formulas.inc'

    include 'join_formulas.inc'

    include 'angle_formulas.inc'

    include 'tangent_formulas.inc'

    include 'tangent_short_formulas.inc'

    include 'tangent_middle_formulas.inc'

end module frb_flow_tangent_lanes
