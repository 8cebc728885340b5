!> The free flow of one body, in its principal axes. One case distinction only, on the length of the step:
!> short and middle ones by series, here; longer ones by doubling, in frb_flow_long.
!>
!> Closed form: m by the addition theorem of the elliptic functions written in m itself; attitude q e z with e
!> a rotation about m by an angle with one integral of the third kind, z algebraic. Updates here are
!> increments.
module frb_flow_one
    use frb_flow_limits, only: short_limit, tiny_limit, tiny_turn_limit, small_turn_limit, middle_limit, &
        middle_turn_limit, plain_largest, plain_smallest
    use frb_flow_long, only: long_step
    use frb_inertia, only: body_core, keep_off_axis
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_momentum, status_bad_attitude, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: flow_body, flow_one, turn_back

    !> What flow_one is asked for within this module.
    integer, parameter :: by_rescaling = 1, for_change = 2
    !> How far a step reaches: which series it takes.
    integer, parameter :: tiny_step = 1, short_step = 2, middle_step = 3
    real(wp), parameter :: largest_square_angle = 1.0e40_wp

contains

    !> Advances m, and q when present, of any body by h; code says why the input was refused, if it was.
    pure subroutine flow_body(body, h, m, code, q)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)

        code = body%status
        if (code /= status_ok) return
        if (body%needs_rotation) then
            call flow_in_principal_axes(body, h, m, code, q)
        else
            call flow_one(body, h, m, code, q)
        end if
    end subroutine flow_body

    !> Advances m, and q when present, by h. `body` has status_ok and its own axes are principal.
    !> code: status_ok, or why the input was refused (it is then untouched).
    pure recursive subroutine flow_one(body, h, m, code, q, asked)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)
        !> With by_rescaling, flow_rescaled is not called again; with for_change, m comes back as its change.
        integer, intent(in), optional :: asked
        real(wp) :: t, a, b, g, m1, m2, m3, gg, p, r, nu_first, nu_mirror, rate
        real(wp) :: y, scd, u, w, k, a23, b31, g12, d1, d2, d3
        real(wp) :: nu, v0, v1, v2, v3, angle, twist, cosm1, along, dot, square, change, w0, w1, w2, w3, q3
        integer(int64) :: smallest, largest
        integer :: i1, i2, i3, reach
        logical :: plain, first_form

        i1 = body%order(1)
        i2 = body%order(2)
        i3 = body%order(3)
        m1 = m(i1)
        m2 = m(i2)
        m3 = body%parity*m(i3)      ! sorted axes are right-handed: the last one turns round if need be
        t = 0.5_wp*h
        ! What is finite, not zero and far from overflow goes on; the rest is sorted out apart. No sum or
        ! product overflows on the way.
        smallest = max(magnitude(m(1)), magnitude(m(2)), magnitude(m(3)))
        largest = max(smallest, magnitude(t), magnitude(body%a(1)))
        if (present(q)) then
            largest = max(largest, magnitude(q(1)), magnitude(q(2)), magnitude(q(3)), magnitude(q(4)))
            smallest = min(smallest, max(magnitude(q(1)), magnitude(q(2)), magnitude(q(3)), magnitude(q(4))))
        end if
        plain = are_plain(smallest, largest)
        if (plain) then
            rate = body%a(1)*t
            plain = abs(rate) < plain_largest
        end if
        if (.not. plain) then
            code = status_bad_momentum
            if (present(asked)) then
                if (asked == by_rescaling) return
            end if
            call flow_rescaled(body, h, m, code, q)
            if (present(asked)) call leave_change(asked, [m1, m2, body%parity*m3], [i1, i2, i3], m)
            return
        end if
        code = status_ok
        square = rate*rate*(m1*m1 + m2*m2 + m3*m3)
        if (square > middle_turn_limit) then    ! long whatever the orbit: its constants are formed there
            if (square <= largest_square_angle) then
                call long_step(body, t, m, q)
            else
                if (present(asked)) then
                    if (asked == by_rescaling) call long_step(body, t, m, q)
                    if (asked == for_change) call flow_rescaled(body, h, m, code, q)
                else
                    call flow_rescaled(body, h, m, code, q)
                end if
            end if
            if (present(asked)) call leave_change(asked, [m1, m2, body%parity*m3], [i1, i2, i3], m)
            return
        end if
        call orbit_constants(body%alpha, body%beta, body%gamma, t, m1, m2, m3, a, b, g, gg, p, r, nu_first, &
                             nu_mirror)
        if (max(p, r) <= tiny_limit .and. square <= tiny_turn_limit) then
            reach = tiny_step
        else if (max(p, r) <= short_limit .and. square <= small_turn_limit) then
            reach = short_step
        else if (max(p, r) <= middle_limit) then
            reach = middle_step
        else
            call long_step(body, t, m, q)
            if (present(asked)) call leave_change(asked, [m1, m2, body%parity*m3], [i1, i2, i3], m)
            return
        end if
        a23 = a*(m2*m3)
        b31 = b*(m3*m1)
        g12 = g*(m1*m2)
        select case (reach)
        case (tiny_step)
            call tiny_series(p + r, p*r, y, scd)
        case (short_step)
            call short_series(p + r, p*r, y, scd)
        case default
            call middle_series(p + r, p*r, y, scd)
        end select
        u = p*y
        w = r*y
        k = a*g*(m2*m2)
        call short_momentum(u, w, k*(scd*scd), scd, m1, m2, m3, a23, b31, g12, d1, d2, d3)
        m(i1) = m1 + d1
        m(i2) = m2 + d2
        m(i3) = body%parity*(m3 + d3)
        if (present(asked)) then
            if (asked == for_change) m([i1, i2, i3]) = [d1, d2, body%parity*d3]
        end if
        if (.not. present(q)) return

        ! Of the two mirror forms the one with the smaller parameter nu of the third kind.
        first_form = nu_first <= nu_mirror
        if (first_form) then
            nu = nu_first
            angle = rate
            twist = -b*nu
        else
            nu = nu_mirror
            angle = body%a(3)*t
            twist = b*nu
        end if
        select case (reach)
        case (tiny_step)
            angle = angle + twist*tiny_third_kind(p + r, p*r, nu)
            call tiny_turn(angle*angle*gg, along, cosm1)
        case (short_step)
            angle = angle + twist*short_third_kind(p + r, p*r, nu)
            call small_turn(angle*angle*gg, along, cosm1)
        case default
            angle = angle + twist*y*sqrt(y)*middle_third_kind(u, w, nu*y)
            call middle_turn(angle*angle*gg, along, cosm1)
        end select
        along = angle*along
        if (first_form) then
            call short_direction(b, g, w, k*y, y, scd, m2, m3, b31, g12, v0, v2, v3)
            call join_turns(1 + cosm1, along, m1, m2, m3, 1 + v0, v2, v3, w1, w2, w3)
            dot = along*(m2*v2 + m3*v3)
            square = (v0*(2 + v0) + v2*v2) + v3*v3
        else
            call short_direction(b, a, u, k*y, y, scd, m2, m1, b31, a23, v0, v2, v1)
            call join_turns(-(1 + cosm1), along, m3, m2, m1, 1 + v0, v2, v1, w3, w2, w1)
            dot = -along*(m2*v2 + m1*v1)
            square = (v0*(2 + v0) + v2*v2) + v1*v1
        end if
        select case (reach)
        case (tiny_step)
            change = tiny_norm(square)
        case (short_step)
            change = short_norm(square)
        case default
            change = middle_norm(square)
        end select
        call small_unit_turn(cosm1, v0, dot, change, w0, w1, w2, w3)
        q3 = body%parity*q(1 + i3)
        call turn(w0, w1, w2, w3, q(1), q(1 + i1), q(1 + i2), q3)
        q(1 + i3) = body%parity*q3
    end subroutine flow_one

    !> The change of the momentum since `old`, in sorted axes, takes its place where that is asked for.
    pure subroutine leave_change(asked, old, order, m)
        integer, intent(in) :: asked, order(3)
        real(wp), intent(in) :: old(3)
        real(wp), intent(inout) :: m(3)

        if (asked == for_change) m(order) = m(order) - old
    end subroutine leave_change

    !> flow_one for a body whose own axes are not principal, and for a linear rotor, whose constants are those
    !> of a sphere and hold in any axes. Otherwise the momentum is taken to principal axes, and only
    !> the increments are taken back, so that no rounding of the rotation gathers over many steps.
    pure subroutine flow_in_principal_axes(body, h, m, code, q)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)
        real(wp) :: change(3), upright(3), turn(4), size_q

        code = status_bad_momentum
        if (.not. all(ieee_is_finite(m))) return
        if (present(q)) then
            code = status_bad_attitude
            size_q = sum(0.25_wp*abs(q))
            if (.not. ieee_is_finite(size_q)) return
            if (size_q <= 0.0_wp) return
        end if
        if (body%linear) then
            upright = m
            call keep_off_axis(body, upright, code)
            if (code /= status_ok) return
            if (present(q)) then
                call flow_one(body, h, upright, code, q)
            else
                call flow_one(body, h, upright, code)
            end if
            if (code == status_ok) m = upright
            return
        end if
        ! The change of m, not rounded to the digits of m: where axes are all but aligned, what they mix in
        ! would be rounded away in every step, and |m| would drift.
        change = matmul(m, body%axes)
        if (present(q)) then
            turn = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call flow_one(body, h, change, code, turn, for_change)
            if (code == status_ok) call turn_back(body, change, turn, m, q)
        else
            call flow_one(body, h, change, code, asked=for_change)
            if (code == status_ok) m = m + matmul(body%axes, change)
        end if
    end subroutine flow_in_principal_axes

    !> Adds a change of the momentum and a turn of norm one, both in principal axes, to m and q in those of
    !> the body: as increments, so that rounding does not gather in what stays as it is.
    pure subroutine turn_back(body, change, turn, m, q)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: change(3)
        real(wp), intent(in) :: turn(4)
        real(wp), intent(inout) :: m(3), q(4)
        real(wp) :: w(3), w0

        m = m + matmul(body%axes, change)
        w = matmul(body%axes, turn(2:4))
        w0 = turn(1) - 1
        if (turn(1) > 0.5_wp) w0 = -sum(w*w)/(1 + sqrt(1 - sum(w*w)))
        q = q + [q(1)*w0 - (q(2)*w(1) + q(3)*w(2) + q(4)*w(3)), &
                 q(1)*w(1) + q(2)*w0 + (q(3)*w(3) - q(4)*w(2)), &
                 q(1)*w(2) + q(3)*w0 + (q(4)*w(1) - q(2)*w(3)), &
                 q(1)*w(3) + q(4)*w0 + (q(2)*w(2) - q(3)*w(1))]
    end subroutine turn_back

    !> The same flow with momentum, moments and time scaled by powers of 2 to the middle of the exponents; a
    !> time so long that no digit of any phase is left is cut to where the arithmetic holds.
    pure recursive subroutine flow_rescaled(body, h, m, code, q)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4)
        integer, parameter :: cut = 64     ! angles of 2^64 and more have no phase
        type(body_core) :: scaled
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
            call flow_one(scaled, time, m, code, q, by_rescaling)
            q = scale(q, eq)
        else
            call flow_one(scaled, time, m, code, asked=by_rescaling)
        end if
        m = scale(m, em)
    end subroutine flow_rescaled

    !> The bits of a number without its sign, for which flang calls its run-time library: ordered as its size
    !> is, with Inf and NaN above all. Comparing
    !> them raises no exception, and keeps out of the way of the floating-point units.
    elemental function magnitude(x) result(bits)
        real(wp), intent(in) :: x
        integer(int64) :: bits

        bits = iand(transfer(x, 0_int64), huge(0_int64))
    end function magnitude

    !> Whether magnitudes from the smallest to the largest are those of plain numbers.
    pure function are_plain(smallest, largest) result(plain)
        integer(int64), intent(in) :: smallest, largest
        logical :: plain

        plain = largest < transfer(plain_largest, 0_int64) .and. smallest > transfer(plain_smallest, 0_int64)
    end function are_plain

    include 'orbit_formulas.inc'

    include 'series_formulas.inc'

    include 'short_third_kind.inc'

    include 'tiny_formulas.inc'

    include 'tiny_third_kind.inc'

    include 'short_formulas.inc'

    include 'unit_turn_formulas.inc'

    include 'middle_formulas.inc'

    include 'middle_third_kind.inc'

    include 'turn_formulas.inc'

    include 'join_formulas.inc'

    include 'reach_formulas.inc'

end module frb_flow_one
