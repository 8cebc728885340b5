!> Steps of one body beyond the series of frb_flow_one: s^2 by its series at a fraction of the time and
!> doublings, many periods by the arithmetic-geometric mean.
module frb_flow_long
    use frb_flow_limits, only: middle_limit, square_limit, period_limit, smallest_denominator, sin_cos_limit
    use frb_flow_periods, only: reduce_periods
    use frb_inertia, only: rigid_body
    use frb_kinds, only: wp
    implicit none
    private

    public :: long_step

contains

    !> Advances m, and q when present, by 2 t, a time that the series do not reach.
    subroutine long_step(body, t, m, q)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: t           !! h/2
        real(wp), intent(inout) :: m(3)
        real(wp), intent(inout), optional :: q(4)
        real(wp) :: a, b, g, m1, m2, m3, x1, x2, x3, pt, rt, p, r, pmax, pmin, delta, nu, bg, norm
        real(wp) :: fraction, turned, whole, span, angle, along, sine, cosine, inverse
        real(wp) :: s, y, z, c, d, ec, es, old_y, old_z, n1, n2, n3, n0, cp, dr, v0, v1, v2, v3
        real(wp) :: d1, d2, d3, w0, w1, w2, w3, q3
        logical :: with_attitude, cn_is_c, first_form
        integer :: i1, i2, i3, squares, triples

        with_attitude = present(q)
        i1 = body%order(1)
        i2 = body%order(2)
        i3 = body%order(3)
        m1 = m(i1)
        m2 = m(i2)
        m3 = body%parity*m(i3)
        a = body%alpha*t
        b = body%beta*t
        g = body%gamma*t
        x1 = m1*m1
        x2 = m2*m2
        x3 = m3*m3
        pt = b*x1 + a*x2
        rt = g*x2 + b*x3
        p = g*pt
        r = a*rt
        delta = b*((a*x3) - (g*x1))     ! R - P; the parentheses keep it 0 on the separatrix with FMA
        cn_is_c = delta <= 0.0_wp
        delta = abs(delta)
        pmax = max(p, r)
        pmin = min(p, r)
        first_form = g*rt <= a*pt
        nu = merge(g*rt, a*pt, first_form)
        norm = sqrt(x1 + x2 + x3)
        bg = b*norm
        fraction = 1.0_wp
        whole = 0.0_wp
        turned = 1.0_wp
        if (pmax > period_limit) call reduce_periods(pmax, delta, nu, with_attitude, fraction, turned, whole)
        squares = 0
        triples = 0
        span = fraction*fraction
        do while (pmax*span > square_limit)
            span = 0.25_wp*span
            triples = triples + 1
        end do
        do while (pmax*span > middle_limit)       ! nu <= pmax: the product of its two forms is p r
            span = 0.25_wp*span
            squares = squares + 1
        end do
        call middle_series((p + r)*span, p*r*(span*span), y, s)
        y = y*span
        s = 1.0_wp
        ec = 1.0_wp
        es = 0.0_wp
        if (with_attitude) then
            s = sqrt(y)
            call base_angle(bg*(nu*y)*s*middle_third_kind(p*y, r*y, nu*y), ec, es)
        end if
        c = sqrt(1 - pmax*y)
        d = sqrt(1 - pmin*y)
        z = 1.0_wp
        do squares = squares, 1, -1
            old_y = y
            old_z = z
            s = 2*s*((c*d)*z)               ! for the angle; that of the motion is the root of y
            call double_square(pmax, pmin, y, c, d, z)
            if (with_attitude) call double_angle(nu, bg, old_y, old_z, s, c*d, z, ec, es)
        end do
        s = sqrt(y)
        do triples = triples, 1, -1
            old_y = s*s
            old_z = z
            call double_triple(pmax, delta, s, c, d, z)
            if (with_attitude) call double_angle(nu, bg, old_y, old_z, s, c*d, z, ec, es)
            if (z < smallest_denominator) then
                inverse = 1/z
                s = s*inverse
                c = c*inverse
                d = d*inverse
                z = 1.0_wp
                inverse = 1/(abs(ec) + abs(es))
                ec = ec*inverse
                es = es*inverse
            end if
        end do
        es = sign(1.0_wp, fraction)*es
        s = sign(1.0_wp, fraction)*(turned*s)
        c = turned*c
        cp = merge(c, d, cn_is_c)
        dr = merge(d, c, cn_is_c)
        call long_momentum(cn_is_c, a, b, g, s, cp, dr, z, m1, m2, m3, n1, n2, n3, n0, d1, d2, d3)
        m(i1) = m1 + d1
        m(i2) = m2 + d2
        m(i3) = body%parity*(m3 + d3)
        if (.not. present(q)) return
        angle = norm*(merge(body%a(1), body%a(3), first_form)*t)
        angle = angle - merge(1.0_wp, -1.0_wp, first_form)*bg*(nu*whole)
        if (abs(angle) <= sin_cos_limit) then
            call sin_cos(angle, sine, cosine)
        else
            sine = sin(angle)
            cosine = cos(angle)
        end if
        c = cosine*ec + merge(sine, -sine, first_form)*es
        along = (sine*ec - merge(cosine, -cosine, first_form)*es)/norm
        if (first_form) then
            call long_direction(b, g, s, dr, z, n0, n2, n3, v0, v2, v3)
            call join_turns(c, along, m1, m2, m3, v0, v2, v3, w1, w2, w3)
            d = c*v0 - along*(m2*v2 + m3*v3)
        else
            call long_direction(b, a, s, cp, z, n0, n2, n1, v0, v2, v1)
            call join_turns(-c, along, m3, m2, m1, v0, v2, v1, w3, w2, w1)
            d = c*v0 + along*(m2*v2 + m1*v1)
        end if
        call unit_turn(d, w0, w1, w2, w3)
        q3 = body%parity*q(1 + i3)
        call turn(w0, w1, w2, w3, q(1), q(1 + i1), q(1 + i2), q3)
        q(1 + i3) = body%parity*q3
    end subroutine long_step

    include 'middle_formulas.inc'

    include 'long_formulas.inc'

    include 'turn_formulas.inc'

end module frb_flow_long
