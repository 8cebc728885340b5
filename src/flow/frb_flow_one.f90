!> The free flow of one body, in its principal axes: short steps by series, longer ones by doubling, many
!> periods by the arithmetic-geometric mean. One case distinction only, on the length of the step.
!>
!> Closed form: m by the addition theorem of the elliptic functions written in m itself; attitude q e z with e
!> a rotation about m by an angle with one integral of the third kind, z algebraic. Updates are increments.
module frb_flow_one
    use frb_flow_limits, only: short_limit, tiny_limit, tiny_turn_limit, small_turn_limit, &
        middle_turn_limit, base_limit, square_limit, period_limit, sin_cos_limit, plain_largest, &
        plain_smallest
    use frb_flow_periods, only: reduce_periods
    use frb_inertia, only: rigid_body
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_momentum, status_bad_attitude, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: flow_body, flow_one, flow_turned

    !> How far a step reaches: which series it takes.
    integer, parameter :: tiny_step = 1, short_step = 2, middle_step = 3, long_reach = 4
    real(wp), parameter :: largest_square_angle = 1.0e40_wp

contains

    !> Advances m, and q when present, of any body by h; code says why the input was refused, if it was.
    subroutine flow_body(body, h, m, code, q)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)

        code = body%status
        if (code /= status_ok) return
        if (body%turned) then
            call flow_turned(body, h, m, code, q)
        else
            call flow_one(body, h, m, code, q)
        end if
    end subroutine flow_body

    !> Advances m, and q when present, by h. `body` has status_ok and its own axes are principal.
    !> code: status_ok, or why the input was refused (it is then untouched).
    recursive subroutine flow_one(body, h, m, code, q)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)
        real(wp) :: t, a, b, g, m1, m2, m3, x1, x2, x3, pt, rt, p, r, rate, gg
        real(wp) :: size_m, size_q, largest
        real(wp) :: s, y, scd, u, w, k, a23, b31, g12, d1, d2, d3
        real(wp) :: nu, v0, v2, v3, angle, twist, z0, z2, z3, cosm1, sinc, z(3)
        real(wp) :: e1, e2, e3, w0, w1, w2, w3
        integer :: i1, i2, i3, i, reach
        logical :: plain

        i1 = body%order(1)
        i2 = body%order(2)
        i3 = body%order(3)
        m1 = m(i1)
        m2 = m(i2)
        m3 = m(i3)
        t = 0.5_wp*h
        ! What is finite, not zero and far from overflow goes on; the rest is sorted out apart. No comparison
        ! sees a NaN, no sum or product overflows on the way.
        size_m = 0.25_wp*abs(m1) + 0.25_wp*abs(m2) + 0.25_wp*abs(m3)
        largest = 0.25_wp*size_m + 0.25_wp*abs(t)
        size_q = 1.0_wp
        if (present(q)) then
            size_q = 0.25_wp*abs(q(1)) + 0.25_wp*abs(q(2)) + 0.25_wp*abs(q(3)) + 0.25_wp*abs(q(4))
            largest = largest + 0.25_wp*size_q
        end if
        plain = ieee_is_finite(largest)
        if (plain) plain = max(largest, body%a(1)) < plain_largest .and. min(size_m, size_q) > plain_smallest
        if (plain) then
            rate = body%a(1)*t
            plain = abs(rate) < plain_largest
        end if
        if (.not. plain) then
            call flow_rescaled(body, h, m, code, q)
            return
        end if
        code = status_ok
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
        gg = x1 + x2 + x3
        ! nu <= max(p, r) needs no test: the product of its two forms is p r.
        if (max(p, r) > base_limit .or. rate*rate*gg > middle_turn_limit) then
            if (rate*rate*gg > largest_square_angle) then
                call flow_rescaled(body, h, m, code, q)
                return
            end if
            reach = long_reach
            call long_step(body, t, m1, m2, m3, present(q), d1, d2, d3, v0, v2, v3, cosm1, angle)
            if (present(q)) i = merge(i3, i1, g*rt <= a*pt)
        else
            a23 = (body%parity*a)*(m2*m3)
            b31 = (body%parity*b)*(m3*m1)
            g12 = (body%parity*g)*(m1*m2)
            if (max(p, r) <= tiny_limit .and. rate*rate*gg <= tiny_turn_limit) then
                reach = tiny_step
                call tiny_series(p + r, p*r, y, scd)
            else if (max(p, r) <= short_limit .and. rate*rate*gg <= small_turn_limit) then
                reach = short_step
                call short_series(p + r, p*r, y, scd)
            else
                reach = middle_step
                call base_series(p, r, 1.0_wp, s, y)
                scd = s*sqrt((1 - p*y)*(1 - r*y))
            end if
            u = p*y
            w = r*y
            k = (a*g*x2)*y
            call short_momentum(u, w, 4*(a*g*x2)*(scd*scd), scd, m1, m2, m3, a23, b31, g12, d1, d2, d3)
            if (present(q)) then
                ! Of the two mirror forms the one with the smaller parameter nu of the third kind.
                if (g*rt <= a*pt) then
                    i = i3
                    nu = g*rt
                    v0 = (1 - w)*(1 - k)
                    v2 = -g*(1 - w)*(m2*scd + b31*y)
                    v3 = -b*(m3*scd - g12*y*(1 - w))
                    angle = rate
                    twist = -b*nu
                else
                    i = i1
                    nu = a*pt
                    v0 = (1 - u)*(1 - k)
                    v2 = a*(1 - u)*(m2*scd + b31*y)
                    v3 = b*(m1*scd - a23*y*(1 - u))
                    angle = body%a(3)*t
                    twist = b*nu
                end if
                select case (reach)
                case (tiny_step)
                    angle = angle + twist*tiny_third_kind(p + r, p*r, nu)
                    call tiny_turn(angle*angle*gg, sinc, cosm1)
                case (short_step)
                    angle = angle + twist*y*sqrt(y)*short_third_kind(u, w, nu*y)
                    call small_turn(angle*angle*gg, sinc, cosm1)
                case default
                    angle = angle + twist*y*s*base_third_kind(u, w, nu*y)
                    call middle_turn(angle*angle*gg, sinc, cosm1)
                end select
                angle = angle*sinc
            end if
        end if
        if (present(q)) then
            call unit_increment(v0, v2, v3, z0, z2, z3)
            z = 0.0_wp
            z(i2) = z2
            z(i) = z3
            e1 = angle*m(1)
            e2 = angle*m(2)
            e3 = angle*m(3)
            call join_turns(cosm1, e1, e2, e3, z0, z(1), z(2), z(3), w1, w2, w3)
            if (reach <= short_step) then
                ! The scalar part of a small turn follows from the norm.
                w0 = w1*w1 + w2*w2 + w3*w3
                w0 = -w0/(1 + sqrt(1 - w0))
            else
                call close_turn(cosm1, e1, e2, e3, z0, z(1), z(2), z(3), w0, w1, w2, w3)
            end if
            call turn(w0, w1, w2, w3, q(1), q(2), q(3), q(4))
        end if
        m(i1) = m1 + d1
        m(i2) = m2 + d2
        m(i3) = m3 + d3
    end subroutine flow_one

    !> First terms of short_series: for max(p, r) <= tiny_limit the next are below 1e-17.
    pure subroutine tiny_series(e1, e2, y, scd)
        real(wp), intent(in) :: e1, e2
        real(wp), intent(out) :: y, scd

        y = 1 - e1*(1/3.0_wp - e1*(2/45.0_wp - e1*(1/315.0_wp))) + e2*(1/5.0_wp - e1*(3/35.0_wp))
        scd = 1 - e1*(2/3.0_wp - e1*(2/15.0_wp - e1*(4/315.0_wp))) + e2*(3/5.0_wp - e1*(12/35.0_wp))
    end subroutine tiny_series

    !> H in units of t^3 from the first terms of y in t: the integral of y/(1 + nu y).
    pure function tiny_third_kind(e1, e2, nu) result(series)
        real(wp), intent(in) :: e1, e2, nu
        real(wp) :: series

        series = 1/3.0_wp - (e1*(1/15.0_wp - e1*(2/315.0_wp)) - e2*(1/35.0_wp) &
                             + nu*(1/5.0_wp - e1*(2/21.0_wp) - nu*(1/7.0_wp)))
    end function tiny_third_kind

    !> sin(x)/x and cos(x) - 1 from xx = x^2 <= tiny_turn_limit, to rounding.
    pure subroutine tiny_turn(xx, sinc, cosm1)
        real(wp), intent(in) :: xx
        real(wp), intent(out) :: sinc, cosm1

        sinc = 1 - xx*(1/6.0_wp - xx*(1/120.0_wp - xx*(1/5040.0_wp)))
        cosm1 = -xx*(0.5_wp - xx*(1/24.0_wp - xx*(1/720.0_wp - xx*(1/40320.0_wp))))
    end subroutine tiny_turn

    !> sin(x)/x and cos(x) - 1 from xx = x^2 <= middle_turn_limit, to rounding.
    pure subroutine middle_turn(xx, sinc, cosm1)
        real(wp), intent(in) :: xx
        real(wp), intent(out) :: sinc, cosm1

        sinc = 1 - xx*(1/6.0_wp - xx*(1/120.0_wp - xx*(1/5040.0_wp - xx*(1/362880.0_wp - xx*(1/39916800.0_wp &
               - xx*(1/6227020800.0_wp - xx*(1/1307674368000.0_wp - xx*(1/355687428096000.0_wp))))))))
        cosm1 = -xx*(0.5_wp - xx*(1/24.0_wp - xx*(1/720.0_wp - xx*(1/40320.0_wp - xx*(1/3628800.0_wp &
                - xx*(1/479001600.0_wp - xx*(1/87178291200.0_wp - xx*(1/20922789888000.0_wp))))))))
    end subroutine middle_turn

    !> flow_one for a body whose own axes are not principal: the momentum is taken to principal axes, and only
    !> the increments are taken back, so that no rounding of the rotation gathers over many steps.
    subroutine flow_turned(body, h, m, code, q)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)
        real(wp) :: n(3), old(3), change(4), w(3), w0, size_q

        code = status_bad_momentum
        if (.not. all(ieee_is_finite(m))) return
        if (present(q)) then
            code = status_bad_attitude
            size_q = sum(0.25_wp*abs(q))
            if (.not. ieee_is_finite(size_q)) return
            if (size_q <= 0.0_wp) return
        end if
        old = matmul(m, body%axes)
        n = old
        if (present(q)) then
            change = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call flow_one(body, h, n, code, change)
        else
            call flow_one(body, h, n, code)
        end if
        if (code /= status_ok) return
        m = m + matmul(body%axes, n - old)
        if (.not. present(q)) return
        w = matmul(body%axes, change(2:4))
        w0 = change(1) - 1
        if (change(1) > 0.5_wp) w0 = -sum(w*w)/(1 + sqrt(1 - sum(w*w)))
        q = q + [q(1)*w0 - (q(2)*w(1) + q(3)*w(2) + q(4)*w(3)), &
                 q(1)*w(1) + q(2)*w0 + (q(3)*w(3) - q(4)*w(2)), &
                 q(1)*w(2) + q(3)*w0 + (q(4)*w(1) - q(2)*w(3)), &
                 q(1)*w(3) + q(4)*w0 + (q(2)*w(2) - q(3)*w(1))]
    end subroutine flow_turned

    !> A step of any length: increments d of m, z as the direction (v0; v2 on axis 2, v3 on axis 3 or 1), and
    !> e = (1 + cosm1, angle m).
    subroutine long_step(body, t, m1, m2, m3, with_attitude, d1, d2, d3, v0, v2, v3, cosm1, angle)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: t           !! h/2
        real(wp), intent(in) :: m1, m2, m3  !! m in sorted axes
        logical, intent(in) :: with_attitude
        real(wp), intent(out) :: d1, d2, d3, v0, v2, v3, cosm1, angle
        real(wp) :: a, b, g, x1, x2, x3, pt, rt, p, r, pmax, pmin, delta, nu, bg, norm
        real(wp) :: fraction, turned, whole, f, span
        real(wp) :: s, y, y1, c, d, cd, ec, es, n1, n2, n3, cp, dr, sine, cosine
        logical :: cn_is_c, first_form
        integer :: squares, triples

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
        f = abs(fraction)
        squares = 0
        triples = 0
        span = fraction*fraction
        do while (pmax*span > square_limit)
            span = 0.25_wp*span
            f = 0.5_wp*f
            triples = triples + 1
        end do
        do while (pmax*span > base_limit)       ! nu <= pmax: the product of its two forms is p r
            span = 0.25_wp*span
            f = 0.5_wp*f
            squares = squares + 1
        end do
        call base_series(p, r, f, s, y)
        ec = 1.0_wp
        es = 0.0_wp
        if (with_attitude) call base_angle(p, r, nu, bg, s, y, ec, es)
        do squares = squares, 1, -1
            y1 = y
            call double_square(p, r, y, s, cd)
            if (with_attitude) call double_angle(nu, bg, y1, s, cd, ec, es)
        end do
        c = sqrt(1 - pmax*y)
        d = sqrt(1 - pmin*y)
        do triples = triples, 1, -1
            y1 = s*s
            call double_triple(pmax, delta, s, c, d)
            if (with_attitude) call double_angle(nu, bg, y1, s, c*d, ec, es)
        end do
        s = sign(s, fraction)
        es = sign(1.0_wp, fraction)*es
        s = turned*s
        c = turned*c
        cp = merge(c, d, cn_is_c)
        dr = merge(d, c, cn_is_c)
        call long_momentum(cn_is_c, a, b, g, s, cp, dr, m1, m2, m3, body%parity, n1, n2, n3, d1, d2, d3)
        v0 = 0.0_wp
        v2 = 0.0_wp
        v3 = 0.0_wp
        cosm1 = 0.0_wp
        angle = 0.0_wp
        if (.not. with_attitude) return
        if (first_form) then
            v0 = dr
            v2 = -g*s*dr*n2
            v3 = -b*s*n3
            angle = norm*(body%a(1)*t) - bg*nu*whole
        else
            v0 = cp
            v2 = a*s*cp*n2
            v3 = b*s*n1
            angle = -(norm*(body%a(3)*t) + bg*nu*whole)
        end if
        if (abs(angle) <= sin_cos_limit) then
            call sin_cos(angle, sine, cosine)
        else
            sine = sin(angle)
            cosine = cos(angle)
        end if
        f = 1.5_wp - 0.5_wp*(ec*ec + es*es)     ! (ec, es) back to norm one, to first order
        cosm1 = (cosine*ec + sine*es)*f - 1
        angle = (sine*ec - cosine*es)*(f/norm)
        if (.not. first_form) angle = -angle
    end subroutine long_step

    !> The same flow with momentum, moments and time scaled by powers of 2 to the middle of the exponents; a
    !> time so long that no digit of any phase is left is cut to where the arithmetic holds.
    subroutine flow_rescaled(body, h, m, code, q)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)
        integer, parameter :: cut = 64     ! angles of 2^64 and more have no phase
        type(rigid_body) :: scaled
        real(wp) :: largest, time
        integer :: em, ea, eh, eq

        code = status_ok
        if (.not. all(ieee_is_finite(m))) then
            code = status_bad_momentum
        else if (.not. ieee_is_finite(h)) then
            code = status_bad_time
        else if (present(q)) then
            if (.not. all(ieee_is_finite(q))) then
                code = status_bad_attitude
            else if (maxval(abs(q)) <= 0.0_wp) then
                code = status_bad_attitude
            end if
        end if
        if (code /= status_ok) return
        largest = maxval(abs(m))
        if (largest <= 0.0_wp .or. abs(h) <= 0.0_wp) return
        em = exponent(largest)
        ea = exponent(body%a(1))
        eh = min(exponent(h) + em + ea, cut)
        time = set_exponent(h, eh)
        scaled = body
        scaled%a = scale(body%a, -ea)
        scaled%alpha = scale(body%alpha, -ea)
        scaled%beta = scale(body%beta, -ea)
        scaled%gamma = scale(body%gamma, -ea)
        m = scale(m, -em)
        if (present(q)) then
            eq = exponent(maxval(abs(q)))
            q = scale(q, -eq)
            call flow_one(scaled, time, m, code, q)
            q = scale(q, eq)
        else
            call flow_one(scaled, time, m, code)
        end if
        m = scale(m, em)
    end subroutine flow_rescaled

    include 'flow_formulas.inc'

end module frb_flow_one
