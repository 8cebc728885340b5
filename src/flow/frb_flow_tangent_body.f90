!> The free flow of any body with its derivative, by the steps of frb_flow_tangent_one and
!> frb_flow_tangent_long: refusals, extreme exponents, axes of a tensor, and motions that have reached the
!> unstable axis to all digits.
module frb_flow_tangent_body
    use frb_flow_axes, only: turn_back
    use frb_flow_limits, only: plain_largest, plain_smallest
    use frb_flow_one, only: flow_body
    use frb_flow_tangent_axis, only: follow_axis
    use frb_flow_tangent_inertia, only: inertia_columns, elements_in_axes
    use frb_flow_tangent_long, only: long_tangent
    use frb_flow_tangent_momentum, only: short_jacobian
    use frb_flow_tangent_one, only: short_tangent
    use frb_flow_tangent_parts, only: step_parts
    use frb_inertia, only: axes_of, body_core, keep_off_axis, to_principal
    use frb_kinds, only: wp
    use frb_rotations, only: cross
    use frb_status, only: status_ok, status_bad_momentum, status_bad_attitude, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: tangent_body, jacobian_body

    real(wp), parameter :: largest_square_angle = 1.0e40_wp

contains

    !> tangent_body for the momentum alone.
    pure subroutine jacobian_body(body, h, m, code, jacobian)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        real(wp), intent(inout) :: jacobian(3, 3)
        real(wp) :: size_m, reached
        logical :: plain, done

        code = body%status
        size_m = 0.25_wp*abs(m(1)) + (0.25_wp*abs(m(2)) + 0.25_wp*abs(m(3)))
        plain = are_plain(size_m, size_m, h, body%a(1))
        plain = plain .and. code == status_ok .and. .not. body%needs_rotation
        if (plain) then
            call short_jacobian(body, 0.5_wp*h, m, jacobian, done)
            if (done) return
            plain = (body%a(1)*h)**2*(m(1)*m(1) + m(2)*m(2) + m(3)*m(3)) <= largest_square_angle
        end if
        if (.not. plain) then
            call tangent_body(body, h, m, code, 0, jacobian=jacobian)
            return
        end if
        ! The common case of tangent_beyond.
        call long_tangent(body, 0.5_wp*h, m, .false., reached, jacobian=jacobian)
        if (reached < 1.0_wp) then
            call tangent_beyond(body, h, m, 0, jacobian=jacobian)
        else if (body%parity < 0.0_wp) then
            call reflect(int(body%order(3)), jacobian=jacobian)
        end if
    end subroutine jacobian_body

    !> Advances m, and q when present, of any body by h, with `transition` and, if wanted, the derivatives by
    !> the inertia (6, 3) or (6, 6); without q, with `jacobian`. code says why the input was refused, if it
    !> was: the state then stays, and the derivatives are those of no step.
    pure recursive subroutine tangent_body(body, h, m, code, elements, q, transition, jacobian, by_inertia)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        include 'tangent_results.inc'
        real(wp) :: rate, size_m, size_q
        logical :: plain

        code = body%status
        size_m = 0.25_wp*abs(m(1)) + (0.25_wp*abs(m(2)) + 0.25_wp*abs(m(3)))
        size_q = size_m
        if (present(q)) size_q = (abs(q(1)) + abs(q(2))) + (abs(q(3)) + abs(q(4)))
        plain = are_plain(size_m, size_q, h, body%a(1))
        plain = plain .and. code == status_ok .and. .not. body%needs_rotation
        if (plain) plain = abs(h) > 0.0_wp
        if (plain) then
            rate = body%a(1)*h
            plain = rate*rate*(m(1)*m(1) + m(2)*m(2) + m(3)*m(3)) <= largest_square_angle
        end if
        if (plain) then
            call tangent_plain(body, h, m, elements, q, transition, jacobian, by_inertia)
            return
        end if
        if (code == status_ok) code = refusal(h, m, q)
        if (code /= status_ok) then
            call no_step(elements, q, transition, jacobian, by_inertia)
        else if (body%needs_rotation) then
            call tangent_turned(body, h, m, code, elements, q, transition, jacobian, by_inertia)
        else if (maxval(abs(m)) <= 0.0_wp .or. abs(h) <= 0.0_wp) then
            call no_step(elements, q, transition, jacobian, by_inertia)
            if (present(transition)) call turns_from_rest(body, h, transition)
        else
            call tangent_rescaled(body, h, m, elements, q, transition, jacobian, by_inertia)
        end if
    end subroutine tangent_body

    !> The derivatives of the identity.
    pure subroutine no_step(elements, q, transition, jacobian, by_inertia)
        integer, intent(in) :: elements
        real(wp), intent(in), optional :: q(4)
        real(wp), intent(inout), optional :: transition(6, 6)
        real(wp), intent(inout), optional :: jacobian(3, 3)
        real(wp), intent(inout), optional :: by_inertia(6, elements)
        integer :: i

        if (present(q)) then
            transition = 0.0_wp
            do i = 1, 6
                transition(i, i) = 1.0_wp
            end do
            if (present(by_inertia)) by_inertia = 0.0_wp
        else
            jacobian = 0.0_wp
            do i = 1, 3
                jacobian(i, i) = 1.0_wp
            end do
        end if
    end subroutine no_step

    !> Writes W = h I^-1 of a body at rest into `transition`.
    pure subroutine turns_from_rest(body, h, transition)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: transition(6, 6)
        real(wp) :: a(3)
        integer :: i

        a(body%order) = body%a
        do i = 1, 3
            transition(3 + i, i) = h*a(i)
        end do
    end subroutine turns_from_rest

    !> The step in principal axes, all numbers plain, m and h not zero.
    pure subroutine tangent_plain(body, h, m, elements, q, transition, jacobian, by_inertia)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        include 'tangent_results.inc'
        type(step_parts) :: parts
        logical :: done

        if (present(jacobian)) then
            call short_jacobian(body, 0.5_wp*h, m, jacobian, done)
            if (done) return
        else if (present(by_inertia)) then
            call short_tangent(body, 0.5_wp*h, m, done, q, transition, parts)
        else
            call short_tangent(body, 0.5_wp*h, m, done, q, transition)
        end if
        if (.not. done) then
            call tangent_beyond(body, h, m, elements, q, transition, jacobian, by_inertia)
            return
        end if
        if (body%parity < 0.0_wp) call reflect(int(body%order(3)), transition)
        if (present(by_inertia)) call inertia_columns(body, parts, m, elements, by_inertia)
    end subroutine tangent_plain

    !> As tangent_plain, for steps too long for the series. The derivatives of a motion that reaches the
    !> middle axis to all digits continue on this axis.
    pure subroutine tangent_beyond(body, h, m, elements, q, transition, jacobian, by_inertia)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        include 'tangent_results.inc'
        type(step_parts) :: parts
        real(wp) :: reached, all_of_it, n(3), p(4)
        integer :: code

        n = m
        if (present(q)) p = q
        call long_tangent(body, 0.5_wp*h, m, .false., reached, parts, q, transition, jacobian)
        ! With another time |R - P| t^2 would be rounded anew, not always to 0.
        if (reached < 1.0_wp) call long_tangent(body, 0.5_wp*(reached*h), m, .true., all_of_it, parts, q, &
                                                transition, jacobian)
        if (body%parity < 0.0_wp) call reflect(int(body%order(3)), transition, jacobian)
        if (present(by_inertia)) call inertia_columns(body, parts, m, elements, by_inertia)
        if (reached >= 1.0_wp) return
        call follow_axis(body, h, h - reached*h, n, m, elements, q, transition, jacobian, by_inertia)
        if (present(q)) then
            call flow_body(body, h, n, code, p)
            q = p
        else
            call flow_body(body, h, n, code)
        end if
        m = n
    end subroutine tangent_beyond

    !> Sorted axes are right-handed: after an odd sorting the last axis is reversed.
    pure subroutine reflect(axis, transition, jacobian)
        integer, intent(in) :: axis
        real(wp), intent(inout), optional :: transition(6, 6)
        real(wp), intent(inout), optional :: jacobian(3, 3)

        if (present(transition)) then
            transition(axis, 1:3) = -transition(axis, 1:3)
            transition(3 + axis, :) = -transition(3 + axis, :)
            transition(:, axis) = -transition(:, axis)
            transition(4:6, 3 + axis) = -transition(4:6, 3 + axis)
        else
            jacobian(axis, :) = -jacobian(axis, :)
            jacobian(:, axis) = -jacobian(:, axis)
        end if
    end subroutine reflect

    !> For a body whose own axes are not principal, or a linear rotor, which turns as a sphere but has no
    !> momentum along its axis: momentum to principal axes, increments and derivatives back.
    pure recursive subroutine tangent_turned(body, h, m, code, elements, q, transition, jacobian, by_inertia)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out) :: code
        include 'tangent_results.inc'
        type(body_core) :: principal
        real(wp) :: axes(3, 3), n(3), old(3), change(4), c(3)

        call keep_off_axis(body, m, code)
        if (code /= status_ok) then
            call no_step(elements, q, transition, jacobian, by_inertia)
            return
        end if
        principal = body
        principal%needs_rotation = .false.
        axes = axes_of(body)
        old = to_principal(body, m)
        n = old
        if (.not. present(q)) then
            call tangent_body(principal, h, n, code, 0, jacobian=jacobian)
            if (code == status_ok) call flow_body(body, h, m, code)
            jacobian = in_axes(axes, jacobian)
            if (body%linear) call drop_axis(body%axis, jacobian)
            return
        end if
        change = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call tangent_body(principal, h, n, code, elements, change, transition, by_inertia=by_inertia)
        ! m is constant in space. With nearly principal axes n - old would lose the part that the rotation
        ! adds.
        c = 2*cross(change(2:4), old)
        if (code == status_ok) call turn_back(body, cross(change(2:4), c) - change(1)*c, change, m, q)
        transition(1:3, 1:3) = in_axes(axes, transition(1:3, 1:3))
        transition(4:6, 1:3) = product_of(axes, product_of(transition(4:6, 1:3), transpose(axes)))
        transition(4:6, 4:6) = in_axes(axes, transition(4:6, 4:6))
        if (body%linear) call drop_axis(body%axis, transition(:, 1:3))
        if (.not. present(by_inertia)) return
        by_inertia(1:3, :) = product_of(axes, by_inertia(1:3, :))
        by_inertia(4:6, :) = product_of(axes, by_inertia(4:6, :))
        if (elements == 6) by_inertia = product_of(by_inertia, elements_in_axes(axes))
    end subroutine tangent_turned

    !> R x R^T for columns R of axes, that of 1 being 1: a matrix close to 1 is so to all digits.
    pure function in_axes(axes, x) result(y)
        real(wp), intent(in) :: axes(3, 3), x(:, :)
        real(wp) :: y(3, 3)
        integer :: i

        y = x
        do i = 1, 3
            y(i, i) = y(i, i) - 1
        end do
        y = product_of(axes, product_of(y, transpose(axes)))
        do i = 1, 3
            y(i, i) = y(i, i) + 1
        end do
    end function in_axes

    !> The product x y. With terms beyond the largest number a sum is the first of them, Inf: not NaN, the
    !> difference of two. A product with 0 is 0.
    pure function product_of(x, y) result(z)
        real(wp), intent(in) :: x(:, :), y(:, :)
        real(wp) :: z(size(x, 1), size(y, 2))
        real(wp) :: term
        integer :: i, j, k

        if (all(ieee_is_finite(x)) .and. all(ieee_is_finite(y))) then
            z = matmul(x, y)
            return
        end if
        z = 0.0_wp
        do j = 1, size(y, 2)
            do k = 1, size(y, 1)
                do i = 1, size(x, 1)
                    if (.not. (abs(x(i, k)) > 0.0_wp .and. abs(y(k, j)) > 0.0_wp)) cycle
                    term = x(i, k)*y(k, j)
                    if (.not. ieee_is_finite(z(i, j))) cycle
                    if (ieee_is_finite(term)) term = z(i, j) + term
                    z(i, j) = term
                end do
            end do
        end do
    end function product_of

    !> Removes the derivative by the component of the momentum along an axis.
    pure subroutine drop_axis(axis, derivatives)
        real(wp), intent(in) :: axis(3)
        real(wp), intent(inout) :: derivatives(:, :)
        real(wp) :: along(size(derivatives, 1))
        integer :: k

        along = matmul(derivatives, axis)
        do k = 1, 3
            derivatives(:, k) = derivatives(:, k) - along*axis(k)
        end do
    end subroutine drop_axis

    !> As flow_rescaled of one_step.inc: momentum, moments and time scaled by powers of 2 to the middle of the
    !> exponents, a time so long that no digit of any phase is left cut to where the arithmetic holds. J and E
    !> have no unit; W goes as 1/m, dtheta' by the moments as their inverses.
    pure subroutine tangent_rescaled(body, h, m, elements, q, transition, jacobian, by_inertia)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        include 'tangent_results.inc'
        integer, parameter :: cut = 64     ! angles of 2^64 and more have no phase
        type(body_core) :: scaled
        real(wp) :: time
        integer :: em, ea, eq

        em = exponent(maxval(abs(m)))
        ea = exponent(body%a(1))
        time = set_exponent(h, min(exponent(h) + em + ea, cut))
        scaled = scaled_body(body, ea)
        m = scale(m, -em)
        eq = 0
        if (present(q)) then
            eq = exponent(maxval(abs(q)))
            q = scale(q, -eq)
        end if
        call tangent_plain(scaled, time, m, elements, q, transition, jacobian, by_inertia)
        m = scale(m, em)
        if (.not. present(q)) return
        q = scale(q, eq)
        transition(4:6, 1:3) = scale(transition(4:6, 1:3), -em)
        if (present(by_inertia)) then
            by_inertia(1:3, :) = scale(by_inertia(1:3, :), em + ea)
            by_inertia(4:6, :) = scale(by_inertia(4:6, :), ea)
        end if
    end subroutine tangent_rescaled

    include 'plain_numbers.inc'

    include 'extreme_numbers.inc'

end module frb_flow_tangent_body
