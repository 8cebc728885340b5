!> The free flow of one body with its derivative, beyond the steps of frb_flow_tangent_one: the doublings of
!> frb_flow_long with two integrals more, D and the one over dn^2; many periods by one arithmetic-geometric
!> mean.
module frb_flow_tangent_long
    use frb_flow_limits, only: most_halvings, middle_limit, square_limit, period_limit, sin_cos_limit, &
        separatrix
    use frb_flow_tangent_parts, only: step_parts
    use frb_flow_tangent_periods, only: reduce_periods
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    implicit none
    private

    public :: long_tangent

    real(wp), parameter :: longest = 150.0_wp       !! half step times lambda on the separatrix

    !> The state of the doublings. z: common denominator of the triple, by which no doubling divides.
    type :: doubling_state
        real(wp) :: pmax, pmin, delta
        real(wp) :: fraction, turned                        !! of the half step; sign of s and cn
        real(wp) :: whole_third, whole_dd, whole_own        !! integrals over the periods taken out
        real(wp) :: s, y, c, d, z                           !! c: cn, d: dn
        real(wp) :: dd, own, ec, es, bg
        integer :: squares, triples
        logical :: many_periods
    end type doubling_state

contains

    !> Advances m, and q when present, by 2 t, and forms `transition`, or `jacobian` without q. m /= 0,
    !> all numbers plain. On the separatrix (delta <= 1e-200 pmax, or if the caller knows it) a time can be
    !> too long: then nothing is done, and `reached` < 1 is the part of it that is not.
    pure subroutine long_tangent(body, t, m, on_separatrix, reached, parts, q, transition, jacobian)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t
        real(wp), intent(inout) :: m(3)
        logical, intent(in) :: on_separatrix
        real(wp), intent(out) :: reached
        type(step_parts), intent(inout), optional :: parts  !! for derivatives by the inertia
        real(wp), intent(inout), optional :: q(4)
        real(wp), intent(inout), optional :: transition(6, 6)
        real(wp), intent(inout), optional :: jacobian(3, 3)
        type(step_parts) :: f
        type(doubling_state) :: it
        real(wp) :: x, yy, twice, over_d0, x1, x2, x3, y1, y2, y3, t1, t2, t3
        real(wp) :: g1, g2, g3
        real(wp) :: r11, r12, r13, r22, r23, r33, j11, j12, j13, j21, j22, j23, j31, j32, j33, cosine, sine

        call set_orbit(body, t, m, present(q), on_separatrix, f, it)
        reached = 1.0_wp
        if (it%pmax > longest**2 .and. it%delta <= separatrix*it%pmax) then
            reached = 0.99_wp*longest/sqrt(it%pmax)
            return
        end if
        call first_part(f, present(q), it)
        cosine = 1.0_wp
        sine = 0.0_wp
        if (present(q)) call uniform_turn(f, it, cosine, sine)
        call double_up(f, it, present(q))
        call advance_momentum(f, it%delta, m)
        if (present(q)) call advance_attitude(f, it, cosine, sine, q, transition)
        call phase_terms(f%c_is_cn, f%a, f%b, f%g, f%m1, f%m3, f%n2, f%n3, f%s, f%c, f%d, x, yy, twice, &
                         over_d0)
        call long_gradients(f%c_is_cn, f%a, f%b, f%g, f%m1, f%m2, f%m3, f%n1, f%n2, f%n3, f%s, f%c, f%d, &
                            it%dd, it%own, over_d0, x1, x2, x3, y1, y2, y3, t1, t2, t3)
        call turn_matrix(f%d, x, yy, twice, r11, r12, r13, r22, r23, r33)
        x1 = (twice*f%d)*x1
        x2 = (twice*f%d)*x2
        x3 = (twice*f%d)*x3
        y1 = twice*y1
        y2 = twice*y2
        y3 = twice*y3
        call tangent_of_momentum(f%d, x, yy, r11, r12, r13, r22, r23, r33, x1, x2, x3, y1, y2, y3, f%e1, &
                                 f%e2, f%e3, j11, j12, j13, j21, j22, j23, j31, j32, j33)
        ! The shift of the time moves the end along the flow.
        g1 = -2*f%a*f%e2*f%e3
        g2 = 2*f%b*f%e3*f%e1
        g3 = -2*f%g*f%e1*f%e2
        call add_product(g1, g2, g3, t1, t2, t3, j11, j12, j13, j21, j22, j23, j31, j32, j33)
        if (.not. present(q)) then
            call put(f%o1, f%o2, f%o3, 3, 0, j11, j12, j13, j21, j22, j23, j31, j32, j33, jacobian)
            return
        end if
        call put(f%o1, f%o2, f%o3, 6, 0, j11, j12, j13, j21, j22, j23, j31, j32, j33, transition)
        call long_covector(f%c_is_cn, f%a, f%b, f%g, f%m1, f%m2, f%m3, f%gg, it%delta, f%nu, f%s, f%c, f%d, &
                           it%dd, it%own, 2*(f%rate - f%along*f%cosine), g1, g2, g3)
        call tangent_of_attitude(f%side, f%d, x, yy, r11, r12, r13, r22, r23, r33, x1, x2, x3, y1, y2, y3, &
                                 f%e1, f%e2, f%e3, f%m1, f%m2, f%m3, 2*f%along*f%cosine, 2*f%along*f%along, &
                                 g1, g2, g3, j11, j12, j13, j21, j22, j23, j31, j32, j33)
        call add_product(2*f%side*f%g*f%e1, 0.0_wp, -2*f%side*f%a*f%e3, t1, t2, t3, j11, j12, j13, j21, j22, &
                         j23, j31, j32, j33)
        call put(f%o1, f%o2, f%o3, 6, 3, j11, j12, j13, j21, j22, j23, j31, j32, j33, transition)
        transition(1:3, 4:6) = 0.0_wp
        if (present(parts)) then
            parts = f
            parts%dd = it%dd
            parts%own = it%own
            parts%delta = it%delta
        end if
    end subroutine long_tangent

    !> The constants of the motion, with attitude in the form with the smaller nu, and the part of the half
    !> step that remains without whole periods.
    pure subroutine set_orbit(body, t, m, with_attitude, on_separatrix, f, it)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t, m(3)
        logical, intent(in) :: with_attitude, on_separatrix
        type(step_parts), intent(out) :: f
        type(doubling_state), intent(out) :: it
        real(wp) :: mirror, span
        integer :: n

        call set_constants(body, t, m, f, mirror)
        it%delta = orbit_difference(f%a, f%b, f%g, f%m1, f%m3)
        f%c_is_cn = it%delta <= 0.0_wp
        it%delta = merge(0.0_wp, abs(it%delta), on_separatrix)
        it%pmax = max(f%p, f%r)
        it%pmin = min(f%p, f%r)
        if (with_attitude) call choose_form(body, t, mirror, f)
        it%fraction = 1.0_wp
        it%turned = 1.0_wp
        it%whole_third = 0.0_wp
        it%whole_dd = 0.0_wp
        it%whole_own = 0.0_wp
        it%many_periods = it%pmax > period_limit .and. it%delta > separatrix*it%pmax
        if (it%many_periods) then
            call reduce_periods(it%pmax, it%delta, f%nu, with_attitude, it%fraction, it%turned, &
                                it%whole_third, it%whole_dd, it%whole_own)
        end if
        span = it%fraction*it%fraction
        do n = 0, most_halvings - 1
            if (it%pmax*span <= square_limit) exit
            span = 0.25_wp*span
        end do
        it%triples = n
        do n = 0, most_halvings - 1
            if (it%pmax*span <= middle_limit) exit      ! nu, if it is needed, <= pmax
            span = 0.25_wp*span
        end do
        it%squares = n
        it%y = span
    end subroutine set_orbit

    !> The triple and the integrals at the time that the series reach.
    pure subroutine first_part(f, with_attitude, it)
        type(step_parts), intent(in) :: f
        logical, intent(in) :: with_attitude
        type(doubling_state), intent(inout) :: it
        real(wp) :: span, s3, aa

        span = it%y
        call middle_series((f%p + f%r)*span, f%p*f%r*(span*span), it%y, it%s)
        it%y = it%y*span
        it%s = sqrt(it%y)
        call middle_integrals(it%pmax*it%y, it%pmin*it%y, it%dd, aa, it%own)
        s3 = it%y*it%s
        it%ec = 1.0_wp
        it%es = 0.0_wp
        if (with_attitude) then
            it%bg = f%b*sqrt(f%gg)
            call base_angle(it%bg*f%nu*(s3*middle_third_kind(it%pmax*it%y, it%pmin*it%y, f%nu*it%y)), it%ec, &
                            it%es)
        end if
        it%dd = s3*it%dd
        it%own = s3*it%own
        it%z = 1.0_wp
        it%c = sqrt(1 - it%pmax*it%y)
        it%d = sqrt(1 - it%pmin*it%y)
    end subroutine first_part

    !> Cosine and sine of the part of half the angle about m that grows with the time.
    pure subroutine uniform_turn(f, it, cosine, sine)
        type(step_parts), intent(in) :: f
        type(doubling_state), intent(in) :: it
        real(wp), intent(out) :: cosine, sine
        real(wp) :: angle

        angle = sqrt(f%gg)*f%rate - it%bg*(f%nu*it%whole_third)
        call any_sin_cos(angle, sine, cosine)
    end subroutine uniform_turn

    !> All doublings, then the integrals over whole periods: triple in f, integrals in `it`.
    pure subroutine double_up(f, it, with_attitude)
        type(step_parts), intent(inout) :: f
        type(doubling_state), intent(inout) :: it
        logical, intent(in) :: with_attitude
        real(wp) :: old_y, old_z, old_s, old_d, over
        integer :: i

        old_s = it%s
        old_d = it%d
        do i = 1, it%squares
            old_y = it%y
            old_z = it%z
            call double_square(it%pmax, it%pmin, it%y, it%c, it%d, it%z)
            it%s = sqrt(it%y)
            if (with_attitude) call double_angle(f%nu, it%bg, old_y, old_z, it%s, it%c*it%d, it%z, it%ec, &
                                                 it%es)
            over = 1/it%z
            call double_integrals(old_s, old_d, it%s*over, it%d*over, it%dd, it%own)
            old_s = it%s*over
            old_d = it%d*over
        end do
        do i = 1, it%triples
            old_y = it%s*it%s
            old_z = it%z
            call double_triple(it%pmax, it%delta, it%s, it%c, it%d, it%z)
            if (with_attitude) then
                call double_angle(f%nu, it%bg, old_y, old_z, it%s, it%c*it%d, it%z, it%ec, it%es)
                over = 1/(abs(it%ec) + abs(it%es))
                it%ec = it%ec*over
                it%es = it%es*over
            end if
            over = 1/it%z
            it%s = it%s*over
            it%c = it%c*over
            it%d = it%d*over
            it%z = 1.0_wp
            call double_integrals(old_s, old_d, it%s, it%d, it%dd, it%own)
            old_s = it%s
            old_d = it%d
        end do
        over = 1/it%z
        f%s = it%s*over
        it%c = it%c*over
        it%d = it%d*over
        if (it%many_periods) then
            over = sign(1.0_wp, it%fraction)
            it%es = over*it%es
            f%s = over*(it%turned*f%s)
            it%c = it%turned*it%c
            it%dd = over*it%dd + it%whole_dd
            it%own = over*it%own + it%whole_own
        end if
        f%c = merge(it%c, it%d, f%c_is_cn)
        f%d = merge(it%d, it%c, f%c_is_cn)
    end subroutine double_up

    !> m at mid-step and at the end.
    pure subroutine advance_momentum(f, delta, m)
        type(step_parts), intent(inout) :: f
        real(wp), intent(in) :: delta
        real(wp), intent(inout) :: m(3)
        real(wp) :: n0, d1, d2, d3, over

        call long_momentum(f%c_is_cn, delta, f%a, f%b, f%g, f%gg, f%s, f%c, f%d, 1.0_wp, f%m1, f%m2, f%m3, &
                           f%n1, f%n2, f%n3, n0, d1, d2, d3)
        call end_momentum(d1, d2, d3, f, m)
        over = 1/n0
        f%n1 = f%n1*over
        f%n2 = f%n2*over
        f%n3 = f%n3*over
    end subroutine advance_momentum

    !> q at the end, E in `transition`.
    pure subroutine advance_attitude(f, it, cosine, sine, q, transition)
        type(step_parts), intent(inout) :: f
        type(doubling_state), intent(in) :: it
        real(wp), intent(in) :: cosine, sine
        real(wp), intent(inout) :: q(4), transition(6, 6)
        real(wp) :: over, v0, v2, v3, w0, w1, w2, w3, q0, q1, q2, q3
        real(wp) :: e11, e12, e13, e21, e22, e23, e31, e32, e33

        over = 1/sqrt(it%ec*it%ec + it%es*it%es)
        f%cosine = (cosine*it%ec + sine*it%es)*over
        f%along = (sine*it%ec - cosine*it%es)*over/sqrt(f%gg)
        call long_direction(f%b, f%g, f%s, f%d, 1.0_wp, 1.0_wp, f%n2, f%n3, v0, v2, v3)
        call join_turns(f%cosine, f%along, f%m1, f%m2, f%m3, v0, v2, v3, w1, w2, w3)
        w0 = f%cosine*v0 - f%along*(f%m2*v2 + f%m3*v3)
        over = 1/sqrt(w0*w0 + (w1*w1 + w2*w2 + w3*w3))
        w0 = w0*over
        w1 = w1*over
        w2 = w2*over
        w3 = w3*over
        q0 = q(1)
        q1 = (f%side*f%s1)*q(1 + f%o1)
        q2 = f%side*q(1 + f%o2)
        q3 = (f%side*f%s3)*q(1 + f%o3)
        q(1) = q0*w0 - (q1*w1 + q2*w2 + q3*w3)
        q(1 + f%o1) = (f%side*f%s1)*(q1*w0 + (q0*w1 + (q2*w3 - q3*w2)))
        q(1 + f%o2) = f%side*(q2*w0 + (q0*w2 + (q3*w1 - q1*w3)))
        q(1 + f%o3) = (f%side*f%s3)*(q3*w0 + (q0*w3 + (q1*w2 - q2*w1)))
        call small_turn_matrix(w0 - 1, w1, w2, w3, e11, e12, e13, e21, e22, e23, e31, e32, e33)
        call put(f%o1, f%o2, f%o3, 6, 21, e11, e12, e13, e21, e22, e23, e31, e32, e33, transition)
    end subroutine advance_attitude

    include 'tangent_forms.inc'

    include 'body_doublings.inc'

    include 'middle_polynomials.inc'

    include 'tangent_formulas.inc'

    include 'tangent_turn_formulas.inc'

    include 'tangent_middle_formulas.inc'

    include 'tangent_long_formulas.inc'

    include 'tangent_phase_formulas.inc'

    include 'tangent_product_formulas.inc'

    include 'tangent_storage.inc'

end module frb_flow_tangent_long
