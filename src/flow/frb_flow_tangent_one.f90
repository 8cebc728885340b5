!> The free flow of one body with its derivative, in its principal axes, for steps that the series reach;
!> longer ones are in frb_flow_tangent_long. The step is that of frb_flow_one; see tangent_formulas.inc.
module frb_flow_tangent_one
    use frb_flow_limits, only: short_limit, tiny_limit, tiny_turn_limit, small_turn_limit, middle_limit, &
        middle_turn_limit
    use frb_flow_tangent_parts, only: step_parts
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    implicit none
    private

    public :: short_tangent

    !> The series that a step uses.
    integer, parameter :: tiny_step = 1, short_step = 2, middle_step = 3, long_step = 4

contains

    !> Advances m and q by 2 t, and forms `transition`. `done` is .false., and nothing is changed, when the
    !> step is too long for the series. m /= 0, all numbers plain.
    pure subroutine short_tangent(body, t, m, done, q, transition, parts)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t
        real(wp), intent(inout) :: m(3)
        logical, intent(out) :: done
        real(wp), intent(inout) :: q(4)
        real(wp), intent(inout) :: transition(6, 6)
        type(step_parts), intent(inout), optional :: parts  !! for derivatives by the inertia
        type(step_parts) :: f
        real(wp) :: x, v, x1, x2, x3, v1, v2, v3, over_w, over_gg, twice, k, psi
        real(wp) :: r11, r12, r13, r22, r23, r33, w11, w12, w13, w21, w22, w23, w31, w32, w33
        real(wp) :: e11, e12, e13, e21, e22, e23, e31, e32, e33
        integer :: reach

        call set_form(body, t, m, f, reach)
        done = reach < long_step
        if (.not. done) return
        call set_series(f, reach)
        call advance_momentum(f, m)
        call short_gradients(f%a, f%b, f%g, f%m1, f%m2, f%m3, f%gg, f%p, f%r, f%nu, f%y, f%scd, f%aa, f%bb, &
                             x, v, x1, x2, x3, v1, v2, v3, over_w, over_gg)
        call advance_attitude(f, reach, q, twice, e11, e12, e13, e21, e22, e23, e31, e32, e33)
        call put(f%o1, f%o2, f%o3, 6, 21, e11, e12, e13, e21, e22, e23, e31, e32, e33, transition)
        call turn_matrix(1.0_wp, x, v, twice, r11, r12, r13, r22, r23, r33)
        x1 = twice*x1
        x2 = twice*x2
        x3 = twice*x3
        v1 = twice*v1
        v2 = twice*v2
        v3 = twice*v3
        psi = -2*(f%b*f%g)*((f%dd + (1 - f%r*f%y)*f%bb)*over_w)
        k = 2*((f%rate - f%along*f%cosine) - (f%b*f%nu)*((1 - f%p*f%y)*f%aa*over_w))*over_gg
        call tangent_of_attitude(f%side, 1.0_wp, x, v, r11, r12, r13, r22, r23, r33, x1, x2, x3, v1, v2, v3, &
                                 f%e1, f%e2, f%e3, f%m1, f%m2, f%m3, 2*f%along*f%cosine, 2*f%along*f%along, &
                                 k*f%m1, (k + psi*f%g)*f%m2, (k + psi*f%b)*f%m3, &
                                 w11, w12, w13, w21, w22, w23, w31, w32, w33)
        call put(f%o1, f%o2, f%o3, 6, 3, w11, w12, w13, w21, w22, w23, w31, w32, w33, transition)
        if (reach <= short_step) then
            ! J = E + m'^ W keeps all digits where the angle is small, and takes 4 % less time.
            call add_moment(f%side*f%e1, f%side*f%e2, f%side*f%e3, w11, w21, w31, e11, e21, e31)
            call add_moment(f%side*f%e1, f%side*f%e2, f%side*f%e3, w12, w22, w32, e12, e22, e32)
            call add_moment(f%side*f%e1, f%side*f%e2, f%side*f%e3, w13, w23, w33, e13, e23, e33)
        else
            call tangent_of_momentum(1.0_wp, x, v, r11, r12, r13, r22, r23, r33, x1, x2, x3, v1, v2, v3, &
                                     f%e1, f%e2, f%e3, e11, e12, e13, e21, e22, e23, e31, e32, e33)
        end if
        call put(f%o1, f%o2, f%o3, 6, 0, e11, e12, e13, e21, e22, e23, e31, e32, e33, transition)
        transition(1:3, 4:6) = 0.0_wp
        if (present(parts)) call describe(f, parts)
    end subroutine short_tangent

    !> x <- x + m x w, columns of three.
    pure subroutine add_moment(m1, m2, m3, w1, w2, w3, x1, x2, x3)
        real(wp), intent(in) :: m1, m2, m3, w1, w2, w3
        real(wp), intent(inout) :: x1, x2, x3

        x1 = x1 + (m2*w3 - m3*w2)
        x2 = x2 + (m3*w1 - m1*w3)
        x3 = x3 + (m1*w2 - m2*w1)
    end subroutine add_moment

    !> The constants of the motion, in the form with the smaller nu unless the step is too long for the
    !> series.
    pure subroutine set_form(body, t, m, f, reach)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t, m(3)
        type(step_parts), intent(out) :: f
        integer, intent(out) :: reach
        real(wp) :: square, mirror, pmax

        call set_constants(body, t, m, f, mirror)
        square = f%rate*f%rate*f%gg
        pmax = max(f%p, f%r)
        reach = middle_step
        if (square > middle_turn_limit .or. pmax > middle_limit) then
            reach = long_step
            return
        else if (square <= tiny_turn_limit .and. pmax <= tiny_limit) then
            reach = tiny_step
        else if (square <= small_turn_limit .and. pmax <= short_limit) then
            reach = short_step
        end if
        call choose_form(body, t, mirror, f)
    end subroutine set_form

    !> The triple and the four integrals.
    pure subroutine set_series(f, reach)
        type(step_parts), intent(inout) :: f
        integer, intent(in) :: reach
        real(wp) :: e1, e2, s3

        e1 = f%p + f%r
        e2 = f%p*f%r
        select case (reach)
        case (tiny_step)
            call tiny_series(e1, e2, f%y, f%scd)
            f%third = tiny_third_kind(e1, e2, f%nu)
            call tiny_integrals(e1, e2, f%p, f%r, f%dd, f%aa, f%bb)
        case (short_step)
            call short_series(e1, e2, f%y, f%scd)
            f%third = short_third_kind(e1, e2, f%nu)
            call short_integrals(e1, e2, f%p, f%r, f%dd, f%aa, f%bb)
        case default
            call middle_series(e1, e2, f%y, f%scd)
            call middle_integrals(f%p*f%y, f%r*f%y, f%dd, f%aa, f%bb)
            s3 = f%y*sqrt(f%y)
            f%third = s3*middle_third_kind(f%p*f%y, f%r*f%y, f%nu*f%y)
            f%dd = s3*f%dd
            f%aa = s3*f%aa
            f%bb = s3*f%bb
        end select
    end subroutine set_series

    !> m at the end of the step.
    pure subroutine advance_momentum(f, m)
        type(step_parts), intent(inout) :: f
        real(wp), intent(inout) :: m(3)
        real(wp) :: d1, d2, d3

        call short_momentum(f%p*f%y, f%r*f%y, f%a*f%g*(f%m2*f%m2)*(f%scd*f%scd), f%scd, f%m1, f%m2, f%m3, &
                            f%a*(f%m2*f%m3), f%b*(f%m3*f%m1), f%g*(f%m1*f%m2), d1, d2, d3)
        call end_momentum(d1, d2, d3, f, m)
    end subroutine advance_momentum

    !> q at the end of the step, E, and 2/(1 + x^2 + v^2).
    pure subroutine advance_attitude(f, reach, q, twice, e11, e12, e13, e21, e22, e23, e31, e32, e33)
        type(step_parts), intent(inout) :: f
        integer, intent(in) :: reach
        real(wp), intent(inout) :: q(4)
        real(wp), intent(out) :: twice
        real(wp), intent(out) :: e11, e12, e13, e21, e22, e23, e31, e32, e33
        real(wp) :: angle, cosm1, v0, v2, v3, square, change, w0, w1, w2, w3, q1, q2, q3, k, z0

        angle = f%rate - f%b*f%nu*f%third
        square = angle*angle*f%gg
        select case (reach)
        case (tiny_step)
            call tiny_turn(square, f%along, cosm1)
        case (short_step)
            call small_turn(square, f%along, cosm1)
        case default
            call middle_turn(square, f%along, cosm1)
        end select
        f%along = angle*f%along
        f%cosine = 1 + cosm1
        k = f%a*f%g*(f%m2*f%m2)
        call short_direction(f%b, f%g, f%r*f%y, k*f%y, f%y, f%scd, f%m2, f%m3, f%b*(f%m3*f%m1), &
                             f%g*(f%m1*f%m2), v0, v2, v3)
        call join_turns(f%cosine, f%along, f%m1, f%m2, f%m3, 1 + v0, v2, v3, w1, w2, w3)
        square = (v0*(2 + v0) + v2*v2) + v3*v3
        change = change_of_norm(reach, square)
        z0 = (1 + v0)*(1 + change)
        twice = 2*(z0*z0)
        call small_unit_turn(cosm1, v0, f%along*(f%m2*v2 + f%m3*v3), change, w0, w1, w2, w3)
        q1 = (f%side*f%s1)*q(1 + f%o1)
        q2 = f%side*q(1 + f%o2)
        q3 = (f%side*f%s3)*q(1 + f%o3)
        call turn(w0, w1, w2, w3, q(1), q1, q2, q3)
        q(1 + f%o1) = (f%side*f%s1)*q1
        q(1 + f%o2) = f%side*q2
        q(1 + f%o3) = (f%side*f%s3)*q3
        call small_turn_matrix(w0, w1, w2, w3, e11, e12, e13, e21, e22, e23, e31, e32, e33)
    end subroutine advance_attitude

    !> Further numbers for the derivatives by the inertia.
    pure subroutine describe(f, parts)
        type(step_parts), intent(in) :: f
        type(step_parts), intent(out) :: parts
        real(wp) :: cc, ee, over

        parts = f
        cc = 1 - f%p*f%y
        ee = 1 - f%r*f%y
        parts%s = sqrt(f%y)
        parts%c = sqrt(cc)
        parts%d = sqrt(ee)
        parts%own = merge(f%bb, f%aa, f%c_is_cn)
        parts%delta = abs(f%b*((f%a*(f%m3*f%m3)) - (f%g*(f%m1*f%m1))))
        over = 1/(1 - f%a*f%g*(f%m2*f%m2)*f%y)
        parts%n2 = (f%m2*(parts%c*parts%d) + f%b*f%m3*f%m1*parts%s)*over
        parts%n3 = (f%m3*parts%c - f%g*f%m1*f%m2*(parts%s*parts%d))*over
    end subroutine describe

    include 'tangent_forms.inc'

    include 'orbit_formulas.inc'

    include 'all_series.inc'

    include 'middle_polynomials.inc'

    include 'turn_formulas.inc'

    include 'reach_formulas.inc'

    include 'tangent_formulas.inc'

    include 'tangent_turn_formulas.inc'

    include 'tangent_short_formulas.inc'

    include 'tangent_short_integrals.inc'

    include 'tangent_tiny_integrals.inc'

    include 'tangent_middle_formulas.inc'

    include 'tangent_storage.inc'

end module frb_flow_tangent_one
