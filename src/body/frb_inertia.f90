!> The body: its three principal moments in any order, or a full inertia tensor, and the constants every
!> routine of the flow needs, formed once.
module frb_inertia
    use frb_kinds, only: wp
    use frb_lapack, only: dsyev
    use frb_rotations, only: cross, matrix_to_quat
    use frb_status, only: conclude, status_ok, status_bad_moments, status_bad_tensor, status_lapack_failed
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: rigid_body, principal_axes, sorting_order

    !> A rigid body as the flow sees it. Made by `rigid_body(moments)` or `rigid_body(tensor)`; the components
    !> are for reading. A body that could not be made has `status /= status_ok`, and every routine that takes
    !> a body refuses it with that code.
    type :: rigid_body
        integer :: status = status_bad_moments  !! `status_ok`, or why the body could not be made
        real(wp) :: moments(3) = 0.0_wp         !! principal moments, in the order of the principal axes
        integer :: order(3) = [1, 2, 3]         !! I(order(1)) <= I(order(2)) <= I(order(3))
        real(wp) :: parity = 1.0_wp             !! -1 when `order` is an odd permutation, else +1
        real(wp) :: a(3) = 0.0_wp               !! 1/I, sorted: a(1) >= a(2) >= a(3)
        real(wp) :: alpha = 0.0_wp              !! a(2) - a(3) >= 0, from the difference of the moments
        real(wp) :: beta = 0.0_wp               !! a(1) - a(3) >= 0
        real(wp) :: gamma = 0.0_wp              !! a(1) - a(2) >= 0
        logical :: turned = .false.             !! body axes are not the principal axes
        real(wp) :: axes(3, 3) = 0.0_wp         !! columns: principal axes in body axes; used when `turned`
        real(wp) :: axes_q(4) = 0.0_wp          !! the same rotation as a quaternion, principal to body
    end type rigid_body

    interface rigid_body
        module procedure body_from_moments
        module procedure body_from_tensor
    end interface rigid_body

contains

    !> The body with the given principal moments, in any order and any consistent units.
    !> `status` is `status_bad_moments` unless all three are finite, positive and not denormal.
    pure function body_from_moments(moments) result(body)
        real(wp), intent(in) :: moments(3)  !! I1, I2, I3 > 0
        type(rigid_body) :: body
        real(wp) :: sorted(3)

        ! Finite first: comparing a NaN would raise a floating-point exception.
        if (.not. all(ieee_is_finite(moments))) return
        if (.not. all(moments >= tiny(1.0_wp))) return
        body%status = status_ok
        body%moments = moments
        call sorting_order(moments, body%order, body%parity)
        sorted = moments(body%order)
        body%a = 1/sorted
        ! From the differences of the moments: exact to the last digits for nearly symmetric bodies.
        body%alpha = ((sorted(3) - sorted(2))/sorted(3))/sorted(2)
        body%beta = ((sorted(3) - sorted(1))/sorted(3))/sorted(1)
        body%gamma = ((sorted(2) - sorted(1))/sorted(2))/sorted(1)
    end function body_from_moments

    !> The body with the given inertia tensor about its fixed point; momentum and attitude stay in the axes
    !> the tensor is given in. `status` is `status_bad_tensor` unless the tensor is finite, symmetric to
    !> rounding and positive definite.
    function body_from_tensor(tensor) result(body)
        real(wp), intent(in) :: tensor(3, 3)
        type(rigid_body) :: body
        real(wp) :: moments(3), axes(3, 3)
        integer :: stat

        call principal_axes(tensor, moments, axes, stat)
        if (stat /= status_ok) then
            body%status = stat
            return
        end if
        body = body_from_moments(moments)
        body%axes = axes
        body%axes_q = matrix_to_quat(axes)
        body%turned = body%axes_q(1) < 1.0_wp
    end function body_from_tensor

    !> Principal moments and axes of an inertia tensor: tensor = axes diag(moments) axes^T, by LAPACK's dsyev.
    !> `axes` is a rotation (determinant +1): its columns are the principal axes in the axes of the tensor,
    !> it takes principal components to those of the tensor's axes. `moments` ascend, except that a diagonal
    !> tensor comes back as it is, in its own order with `axes` the identity. Moments and axes are those of a
    !> tensor within a few roundings of the largest moment of the given one.
    !>
    !> `frb_step` and `quat_step` then take m and Q in principal axes, and give them back so:
    !>
    !>     m = matmul(m, axes);   Q = matmul(Q, axes)                  ! to principal axes
    !>     m = matmul(axes, m);   Q = matmul(Q, transpose(axes))       ! and back
    !>
    !> `stat`: `status_bad_tensor` unless finite, symmetric to 8 roundings of the largest entry and positive
    !> definite; `status_lapack_failed` if dsyev does not converge. Moments are then 0, axes the identity.
    subroutine principal_axes(tensor, moments, axes, stat)
        real(wp), intent(in) :: tensor(3, 3)
        real(wp), intent(out) :: moments(3)
        real(wp), intent(out) :: axes(3, 3)
        integer, intent(out), optional :: stat
        real(wp), parameter :: symmetry_tolerance = 8*epsilon(1.0_wp)
        real(wp) :: largest, scaled(3, 3), work(16)
        integer :: code, info, i

        moments = 0.0_wp
        axes = 0.0_wp
        do i = 1, 3
            axes(i, i) = 1.0_wp
        end do
        code = status_bad_tensor
        if (all(ieee_is_finite(tensor))) then
            largest = maxval(abs(tensor))
            if (largest > 0.0_wp) then
                scaled = tensor/largest
                if (all(abs(scaled - transpose(scaled)) <= symmetry_tolerance)) code = status_ok
            end if
        end if
        if (code == status_ok) then
            moments = [tensor(1, 1), tensor(2, 2), tensor(3, 3)]
            if (any(abs([tensor(2, 1), tensor(3, 1), tensor(3, 2)]) > 0.0_wp)) then
                axes = scaled
                call dsyev('V', 'L', 3, axes, 3, moments, work, size(work), info)
                moments = moments*largest
                axes(:, 3) = cross(axes(:, 1), axes(:, 2))
                if (info /= 0) code = status_lapack_failed
            end if
            if (code == status_ok .and. .not. all(moments >= tiny(1.0_wp))) code = status_bad_tensor
            if (code /= status_ok) then
                moments = 0.0_wp
                axes = 0.0_wp
                do i = 1, 3
                    axes(i, i) = 1.0_wp
                end do
            end if
        end if
        call conclude(code, 'principal_axes', stat)
    end subroutine principal_axes

    !> Indices that sort three numbers in ascending order, and the sign of that permutation.
    pure subroutine sorting_order(values, order, parity)
        real(wp), intent(in) :: values(3)
        integer, intent(out) :: order(3)
        real(wp), intent(out) :: parity
        integer :: pass, i

        order = [1, 2, 3]
        parity = 1.0_wp
        do pass = 1, 2
            do i = 1, 3 - pass
                if (values(order(i)) > values(order(i + 1))) then
                    order([i, i + 1]) = order([i + 1, i])
                    parity = -parity
                end if
            end do
        end do
    end subroutine sorting_order

end module frb_inertia
