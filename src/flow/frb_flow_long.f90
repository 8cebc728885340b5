!> Steps of one body beyond the series of one_step.inc: s^2 by its series at a fraction of the time and
!> doublings, many periods by the arithmetic-geometric mean. One routine with and without attitude, so that m
!> is the same to the bit: a long step next to the separatrix makes much of one rounding.
module frb_flow_long
    use frb_flow_limits, only: most_halvings, middle_limit, square_limit, period_limit, &
        smallest_denominator, sin_cos_limit, separatrix, settled
    use frb_inertia, only: body_core
    use frb_kinds, only: wp, pi
    implicit none
    private

    public :: long_step

contains

    !> Advances m, and q if present, by 2 t, a time that the series do not reach.
    pure subroutine long_step(body, t, m, keep, q)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t           !! h/2
        real(wp), intent(inout) :: m(3)     !! comes back as keep m + its change
        real(wp), intent(in) :: keep
        real(wp), intent(inout), optional :: q(4)
        real(wp) :: a, b, g, m1, m2, m3, gg, p, r, nu_first, nu_mirror, pmax, delta, nu, bg, over_norm
        real(wp) :: pmin, old_y, old_z, fraction, turned, whole, span, sine, cosine
        real(wp) :: s, y, z, c, d, ec, es, n1, n2, n3, n0, cp, dr, d1, d2, d3
        logical :: with_attitude, cn_is_c, first_form
        integer :: i1, i2, i3, squares, triples

        with_attitude = present(q)
        call sort_momentum(body, m, i1, i2, i3, m1, m2, m3)
        call orbit_constants(body%alpha, body%beta, body%gamma, t, m1, m2, m3, a, b, g, gg, p, r, nu_first, &
                             nu_mirror)
        delta = orbit_difference(a, b, g, m1, m3)
        cn_is_c = delta <= 0.0_wp
        delta = abs(delta)
        pmax = max(p, r)
        pmin = min(p, r)
        first_form = nu_first <= nu_mirror
        nu = min(nu_first, nu_mirror)
        fraction = 1.0_wp
        whole = 0.0_wp
        turned = 1.0_wp
        if (pmax > period_limit) call reduce_periods(pmax, delta, nu, with_attitude, fraction, turned, whole)
        ! Halvings to a part, the root of span, that the series reach: counted, so that NaN ends them too.
        span = fraction*fraction
        do triples = 0, most_halvings - 1
            if (pmax*span <= square_limit) exit
            span = 0.25_wp*span
        end do
        do squares = 0, most_halvings - 1
            if (pmax*span <= middle_limit) exit
            span = 0.25_wp*span
        end do
        call middle_series((p + r)*span, p*r*(span*span), y, s)
        y = y*span
        s = sqrt(y)
        ! Operations that do not need the doublings come before them, so that both run at the same time.
        call angles(body, t, with_attitude, first_form, b, gg, p, r, nu, whole, y, s, bg, over_norm, sine, &
                    cosine, ec, es)
        z = 1.0_wp
        if (squares == 0) then
            c = sqrt(1 - pmax*y)
            d = sqrt(1 - pmin*y)
        end if
        do squares = squares, 1, -1
            old_y = y
            old_z = z
            call double_square(pmax, pmin, y, c, d, z)
            s = sqrt(y)
            if (with_attitude) call double_angle(nu, bg, old_y, old_z, s, c*d, z, ec, es)
        end do
        do triples = triples, 1, -1
            old_y = s*s
            old_z = z
            call double_triple(pmax, delta, s, c, d, z)
            if (with_attitude) call double_angle(nu, bg, old_y, old_z, s, c*d, z, ec, es)
            if (z < smallest_denominator) call divide_by_sizes(s, c, d, z, ec, es)
        end do
        es = sign(1.0_wp, fraction)*es
        s = sign(1.0_wp, fraction)*(turned*s)
        c = turned*c
        cp = merge(c, d, cn_is_c)
        dr = merge(d, c, cn_is_c)
        call long_momentum(cn_is_c, delta, a, b, g, gg, s, cp, dr, z, m1, m2, m3, n1, n2, n3, n0, d1, d2, d3)
        m(i1) = keep*m1 + d1
        m(i2) = keep*m2 + d2
        m(i3) = body%parity*(keep*m3 + d3)
        if (with_attitude) call turn_long(body, first_form, a, b, g, over_norm, s, cp, dr, z, m1, m2, m3, &
                                          n1, n2, n3, n0, sine, cosine, ec, es, q)
    end subroutine long_step

    !> Further numbers for the attitude: the uniform turn about m as (cosine, sine), the other part of the
    !> angle at the part of the time as (ec, es), b |m| and 1/|m|; no angle without attitude.
    pure subroutine angles(body, t, with_attitude, first_form, b, gg, p, r, nu, whole, y, s, bg, over_norm, &
                           sine, cosine, ec, es)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t, b, gg, p, r, nu, whole, y, s
        logical, intent(in) :: with_attitude, first_form
        real(wp), intent(out) :: bg, over_norm, sine, cosine, ec, es
        real(wp) :: norm, angle

        bg = 0.0_wp
        over_norm = 0.0_wp
        sine = 0.0_wp
        cosine = 1.0_wp
        ec = 1.0_wp
        es = 0.0_wp
        if (.not. with_attitude) return
        norm = sqrt(gg)
        over_norm = 1/norm
        bg = b*norm
        angle = norm*(merge(body%a(1), body%a(3), first_form)*t)
        angle = angle - merge(1.0_wp, -1.0_wp, first_form)*bg*(nu*whole)
        call any_sin_cos(angle, sine, cosine)
        call base_angle(bg*(nu*y)*s*middle_third_kind(p*y, r*y, nu*y), ec, es)
    end subroutine angles

    !> Divides the triple by its denominator and the angle by its size, before they underflow.
    pure subroutine divide_by_sizes(s, c, d, z, ec, es)
        real(wp), intent(inout) :: s, c, d, z, ec, es
        real(wp) :: inverse

        inverse = 1/z
        s = s*inverse
        c = c*inverse
        d = d*inverse
        z = 1.0_wp
        inverse = 1/(abs(ec) + abs(es))
        ec = ec*inverse
        es = es*inverse
    end subroutine divide_by_sizes

    !> Turns q by e z over its norm: (cosine, sine) is the uniform turn about m, (ec, es) the rest of the
    !> angle.
    pure subroutine turn_long(body, first_form, a, b, g, over_norm, s, cp, dr, z, m1, m2, m3, n1, n2, n3, &
                              n0, sine, cosine, ec, es, q)
        type(body_core), intent(in) :: body
        logical, intent(in) :: first_form
        real(wp), intent(in) :: a, b, g, over_norm, s, cp, dr, z, m1, m2, m3, n1, n2, n3, n0
        real(wp), intent(in) :: sine, cosine, ec, es
        real(wp), intent(inout) :: q(4)
        real(wp) :: c, along, v0, v1, v2, v3, w0, w1, w2, w3, q3

        c = cosine*ec + merge(sine, -sine, first_form)*es
        along = (sine*ec - merge(cosine, -cosine, first_form)*es)*over_norm
        if (first_form) then
            call long_direction(b, g, s, dr, z, n0, n2, n3, v0, v2, v3)
            call join_turns(c, along, m1, m2, m3, v0, v2, v3, w1, w2, w3)
            w0 = c*v0 - along*(m2*v2 + m3*v3)
        else
            call long_direction(b, a, s, cp, z, n0, n2, n1, v0, v2, v1)
            call join_turns(-c, along, m3, m2, m1, v0, v2, v1, w3, w2, w1)
            w0 = c*v0 + along*(m2*v2 + m1*v1)
        end if
        q3 = body%parity*q(1 + body%order(3))
        call turn_far(w0, w1, w2, w3, q(1), q(1 + body%order(1)), q(1 + body%order(2)), q3)
        q(1 + body%order(3)) = body%parity*q3
    end subroutine turn_long

    !> q <- q e/|e|, for a turn that need not be small. The norm is found while q e is formed.
    pure subroutine turn_far(e0, e1, e2, e3, q0, q1, q2, q3)
        real(wp), intent(in) :: e0, e1, e2, e3
        real(wp), intent(inout) :: q0, q1, q2, q3
        real(wp) :: inverse, p0, p1, p2, p3

        inverse = 1/sqrt(e0*e0 + (e1*e1 + e2*e2 + e3*e3))
        p0 = q0*e0 - (q1*e1 + q2*e2 + q3*e3)
        p1 = q1*e0 + (q0*e1 + (q2*e3 - q3*e2))
        p2 = q2*e0 + (q0*e2 + (q3*e1 - q1*e3))
        p3 = q3*e0 + (q0*e3 + (q1*e2 - q2*e1))
        q0 = inverse*p0
        q1 = inverse*p1
        q2 = inverse*p2
        q3 = inverse*p3
    end subroutine turn_far

    !> Whole periods: see remove_periods; `whole` is the integral of the third kind over them. On the
    !> separatrix (delta <= 1e-200 pmax) there are no periods: after 200 units of 1/lambda the motion has
    !> reached the middle axis to all digits, and then turns uniformly.
    pure subroutine reduce_periods(pmax, delta, nu, with_whole, fraction, turned, whole)
        real(wp), intent(in) :: pmax, delta, nu
        logical, intent(in) :: with_whole       !! .false.: `whole` is not wanted and comes back 0
        real(wp), intent(out) :: fraction, turned, whole
        real(wp) :: period, mean

        turned = 1.0_wp
        if (delta <= separatrix*pmax) then
            fraction = min(1.0_wp, settled/sqrt(pmax))
            whole = (1 - fraction)/(pmax + nu)
            return
        end if
        call quarter_period(pmax, delta, nu, with_whole, period, mean)
        call remove_periods(period, fraction, turned)
        whole = (1 - fraction)*mean
    end subroutine reduce_periods

    include 'sorted_momentum.inc'

    include 'period_formulas.inc'

    include 'whole_periods.inc'

    include 'body_doublings.inc'

    include 'middle_coefficients.inc'

end module frb_flow_long
