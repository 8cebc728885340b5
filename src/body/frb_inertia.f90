!> The constants of a body that every routine of the flow needs, formed once, from three principal moments in
!> any order or from a full inertia tensor.
!>
!> Linear rotors have two equal moments I and a third moment 0, as a linear molecule. Their momentum along the
!> axis of the zero moment is 0. Then m' = m x I^-1 m = 0 and the angular velocity is m/I, as for a sphere of
!> moment I: a linear rotor has the constants of this sphere, and the momentum along the axis is checked.
module frb_inertia
    use frb_kinds, only: wp
    use frb_lapack, only: dsyev
    use frb_rotations, only: cross, matrix_to_quat
    use frb_status, only: return_or_stop, status_ok, status_bad_moments, status_bad_momentum, &
        status_bad_tensor, status_lapack_failed
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_c_binding, only: c_bool, c_double, c_int
    use, intrinsic :: iso_fortran_env, only: int32
    implicit none
    private

    public :: body_core, core_from_moments, core_from_tensor, principal_axes, sorting_order
    public :: keep_off_axis, axes_of, to_principal, from_principal

    real(wp), parameter :: identity(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                     0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    real(wp), parameter :: no_turn(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]

    !> The contents of `type(rigid_body)`. A core that could not be made has `status /= status_ok`, and every
    !> routine that takes a body refuses it with that code. Interoperable, so that C can hold arrays of cores.
    type, bind(c) :: body_core
        ! The components that blocks of bodies read come first, in one line of the cache.
        real(c_double) :: lane = 0.0_wp               !! 1 to 3: first axis of the cyclic order; 4: the body
                                                      !! needs a rotation; < 0: moments descend; 0: the body
                                                      !! cannot be in a block
        real(c_double) :: a(3) = 0.0_wp               !! 1/I, sorted: a(1) >= a(2) >= a(3)
        real(c_double) :: alpha = 0.0_wp              !! a(2) - a(3) >= 0, from the differences
        real(c_double) :: beta = 0.0_wp               !! a(1) - a(3) >= 0
        real(c_double) :: gamma = 0.0_wp              !! a(1) - a(2) >= 0
        integer(c_int) :: status = status_bad_moments !! `status_ok`, or why the body could not be made
        integer(c_int) :: order(3) = [1, 2, 3]        !! I(order(1)) <= I(order(2)) <= I(order(3))
        real(c_double) :: moments(3) = 0.0_wp         !! principal moments, in the order of the axes
        real(c_double) :: parity = 1.0_wp             !! -1 when `order` is an odd permutation, else +1
        logical(c_bool) :: linear = .false.           !! a linear rotor
        logical(c_bool) :: needs_rotation = .false.   !! body axes are not principal, or the rotor is linear
        real(c_double) :: axes_high(3, 3) = identity  !! principal axes in body axes as columns, the first 26
                                                      !! bits
        real(c_double) :: axes_low(3, 3) = 0.0_wp     !! the rest: the sum is orthogonal to 1e-23
        real(c_double) :: axes_q(4) = no_turn         !! the same rotation as a quaternion, principal to body
        real(c_double) :: axis(3) = 0.0_wp            !! axis of a linear rotor's zero moment, in body axes
    end type body_core

    !> Moments that differ by less than this part of the largest moment are equal, and smaller moments are 0:
    !> the rounding error of R diag(I) R^T and of its eigenvalues.
    real(wp), parameter :: rank_tolerance = 16*epsilon(1.0_wp)

    !> Largest part of the momentum of a linear rotor that may lie along its axis. It allows for rounding,
    !> also after a kick that has cancelled most of the momentum.
    real(wp), parameter :: axis_tolerance = 1.0e-8_wp

contains

    !> The core of a body with the given principal moments: see `rigid_body`. `status` is
    !> `status_bad_moments` unless all three are finite, positive and not denormal, or one is 0 and the other
    !> two are equal to rounding.
    pure function core_from_moments(moments) result(core)
        real(wp), intent(in) :: moments(3)
        type(body_core) :: core
        real(wp) :: sorted(3)
        integer :: order(3)

        ! Test for finite numbers first: comparing a NaN would raise a floating-point exception.
        if (.not. all(ieee_is_finite(moments))) return
        if (any(moments < 0.0_wp)) return
        call sorting_order(moments, order, core%parity)
        core%order = int(order, c_int)
        sorted = moments(order)
        if (sorted(2) < tiny(1.0_wp)) return
        if (sorted(1) <= 0.0_wp) then
            if (sorted(3) - sorted(2) > rank_tolerance*sorted(3)) return
            core%linear = .true.
            core%needs_rotation = .true.
            core%axis(core%order(1)) = 1.0_wp
            core%a = 1/sorted(3)
        else
            if (sorted(1) < tiny(1.0_wp)) return
            core%a = 1/sorted
            ! From the differences of the moments: exact to the last digits for nearly symmetric bodies.
            core%alpha = ((sorted(3) - sorted(2))/sorted(3))/sorted(2)
            core%beta = ((sorted(3) - sorted(1))/sorted(3))/sorted(1)
            core%gamma = ((sorted(2) - sorted(1))/sorted(2))/sorted(1)
        end if
        core%status = status_ok
        core%moments = moments
        if (.not. core%linear) core%lane = core%parity*core%order(merge(1, 3, core%parity > 0))
    end function core_from_moments

    !> The core of a body with the given inertia tensor: see `rigid_body`. `status` is that of
    !> `principal_axes`.
    function core_from_tensor(tensor) result(core)
        real(wp), intent(in) :: tensor(3, 3)
        type(body_core) :: core
        real(wp) :: moments(3), axes(3, 3)
        integer :: stat

        call principal_axes(tensor, moments, axes, stat)
        if (stat /= status_ok) then
            core%status = stat
            return
        end if
        core = core_from_moments(moments)
        core%axes_q = matrix_to_quat(axes)
        call split_rotation(axes, core%axes_high, core%axes_low)
        if (core%linear) core%axis = matmul(axes, core%axis)
        ! Any element off the diagonal counts: the cosine of an angle below 1e-8 rounds to 1.
        core%needs_rotation = core%linear .or. any(abs(axes - identity) > 0.0_wp)
        if (core%needs_rotation .and. .not. core%linear) core%lane = 4*core%parity
    end function core_from_tensor

    !> A rotation A, known to rounding, as high + low: orthogonal to 1e-23 together, as A - A S/2 is with S =
    !> A^T A - 1, to terms of S^2. The 26 bits of high have exact products and exact sums of products.
    pure subroutine split_rotation(axes, high, low)
        real(wp), intent(in) :: axes(3, 3)
        real(wp), intent(out) :: high(3, 3), low(3, 3)
        real(wp), parameter :: cut = 2.0_wp**27
        real(wp) :: defect(3, 3)

        high = (axes + cut) - cut
        low = axes - high
        defect = matmul(transpose(high), high) - identity
        defect = defect + (matmul(transpose(high), low) + matmul(transpose(low), axes))
        low = low - 0.5_wp*matmul(axes, defect)
    end subroutine split_rotation

    !> The principal axes, to rounding: columns, in body axes.
    pure function axes_of(core) result(axes)
        type(body_core), intent(in) :: core
        real(wp) :: axes(3, 3)

        axes = core%axes_high + core%axes_low
    end function axes_of

    !> A vector of the body in its principal axes. A matrix of rounded axes would change |m| and the energy in
    !> every long step by the same part of an epsilon. Of two parts, only the sums are rounded, as often up as
    !> down.
    pure function to_principal(core, v) result(w)
        type(body_core), intent(in) :: core
        real(wp), intent(in) :: v(3)            !! in body axes
        real(wp) :: w(3)
        integer :: k

        do k = 1, 3
            w(k) = (core%axes_high(1, k)*v(1) + core%axes_high(2, k)*v(2) + core%axes_high(3, k)*v(3)) &
                   + (core%axes_low(1, k)*v(1) + core%axes_low(2, k)*v(2) + core%axes_low(3, k)*v(3))
        end do
    end function to_principal

    !> A vector in principal axes as one of the body: the inverse of `to_principal`.
    pure function from_principal(core, v) result(w)
        type(body_core), intent(in) :: core
        real(wp), intent(in) :: v(3)            !! in principal axes
        real(wp) :: w(3)
        integer :: k

        do k = 1, 3
            w(k) = (core%axes_high(k, 1)*v(1) + core%axes_high(k, 2)*v(2) + core%axes_high(k, 3)*v(3)) &
                   + (core%axes_low(k, 1)*v(1) + core%axes_low(k, 2)*v(2) + core%axes_low(k, 3)*v(3))
        end do
    end function from_principal

    !> Removes from m the component along the axis of a linear rotor, if it is more than rounding. If it is
    !> more than 1e-8 of the momentum, `code` is `status_bad_momentum` and m stays as it is.
    pure subroutine keep_off_axis(core, m, code)
        type(body_core), intent(in) :: core
        real(wp), intent(inout) :: m(3)         !! angular momentum, body axes; finite
        integer, intent(out) :: code
        real(wp) :: along, largest

        code = status_ok
        if (.not. core%linear) return
        ! A quarter of each component: the sum of three may overflow.
        largest = maxval(0.25_wp*abs(m))
        along = sum(core%axis*(0.25_wp*m))
        if (abs(along) > axis_tolerance*largest) then
            code = status_bad_momentum
        else if (abs(along) > 2*epsilon(1.0_wp)*largest) then
            m = m - (4*along)*core%axis
        end if
    end subroutine keep_off_axis

    !> Principal moments and axes of an inertia tensor: tensor = axes diag(moments) axes^T, by LAPACK's dsyev.
    !> `axes` is a rotation (determinant +1). Its columns are the principal axes in the axes of the tensor: it
    !> takes components in principal axes to components in the axes of the tensor. `moments` ascend, except
    !> for a diagonal tensor, whose moments keep their order and whose `axes` are the identity. Moments and
    !> axes are those of a tensor that differs from the given one by a few roundings of the largest moment. A
    !> moment below 16 epsilon of the largest is rounding: it comes back as 0, and the other two, which must
    !> be equal to 16 epsilon, as their mean.
    !>
    !> `frb_step` and `quat_step` take m and Q in principal axes, and return them in principal axes:
    !>
    !>     m = matmul(m, axes);   Q = matmul(Q, axes)                  ! to principal axes
    !>     m = matmul(axes, m);   Q = matmul(Q, transpose(axes))       ! and back
    !>
    !> Products of inertia have the sign of the tensor: tensor(1,2) = - integral of x y dm.
    !>
    !> `stat`: `status_bad_tensor` unless finite, symmetric to 8 roundings of the largest entry and either
    !> positive definite or that of a linear rotor (one moment 0, two equal); `status_lapack_failed` if dsyev
    !> does not converge. Moments are then 0, axes the identity.
    subroutine principal_axes(tensor, moments, axes, stat)
        real(wp), intent(in) :: tensor(3, 3)
        real(wp), intent(out) :: moments(3)
        real(wp), intent(out) :: axes(3, 3)
        integer, intent(out), optional :: stat
        real(wp), parameter :: symmetry_tolerance = 8*epsilon(1.0_wp)
        real(wp) :: largest, scaled(3, 3), work(16)
        integer(int32) :: info
        integer :: code

        moments = 0.0_wp
        axes = identity
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
                call dsyev('V', 'L', 3_int32, axes, 3_int32, moments, work, size(work, kind=int32), info)
                moments = moments*largest
                axes(:, 3) = cross(axes(:, 1), axes(:, 2))
                ! Orthogonal to rounding: LAPACK leaves a few units more.
                axes = axes + 0.5_wp*matmul(axes, identity - matmul(transpose(axes), axes))
                if (info /= 0) code = status_lapack_failed
            end if
            if (code == status_ok) call settle_rank(moments, code)
            if (code /= status_ok) then
                moments = 0.0_wp
                axes = identity
            end if
        end if
        call return_or_stop(code, 'principal_axes', stat)
    end subroutine principal_axes

    !> Where the smallest moment is only rounding beside the largest, the moments become those of a linear
    !> rotor, or are refused. So the rank of a tensor does not depend on its axes.
    pure subroutine settle_rank(moments, code)
        real(wp), intent(inout) :: moments(3)
        integer, intent(inout) :: code
        real(wp) :: largest, parity
        integer :: order(3)

        call sorting_order(moments, order, parity)
        associate (low => moments(order(1)), middle => moments(order(2)), high => moments(order(3)))
            largest = high
            if (low > rank_tolerance*largest) then
                if (low < tiny(1.0_wp)) code = status_bad_tensor
            else if (low < -rank_tolerance*largest .or. high - middle > rank_tolerance*largest &
                     .or. high < tiny(1.0_wp)) then
                code = status_bad_tensor
            else
                middle = middle + 0.5_wp*(high - middle)
                high = middle
                low = 0.0_wp
            end if
        end associate
    end subroutine settle_rank

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
