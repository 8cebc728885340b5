!> Conversions for codes with other variables: angular velocity and momentum, vectors of the body and of
!> space, the quaternion momentum of NO_SQUISH. For one body and for arrays (3, n), (4, n).
!>
!> All are functions. Arrays whose sizes do not match, bodies that could not be made and quaternions whose
!> norm is more than 1e-6 off one give NaN.
module frb_frames
    use frb_free_flow, only: core_of, rigid_body
    use frb_inertia, only: axes_of, body_core
    use frb_kinds, only: wp
    use frb_modified_kicks, only: angular_response
    use frb_rotations, only: rotate_one => quat_rotate, quat_conjugate, unit_tolerance
    use frb_status, only: status_ok
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: angular_velocity, angular_momentum, quat_rotate, quat_rotate_back, quat_momentum, &
        momentum_from_quat

    !> omega = I^-1 m, both in body axes: angular_velocity(body, m); m is (3), or (3, n) with the body one for
    !> all or body(n). About the axis of a linear rotor omega is 0.
    interface angular_velocity
        module procedure velocity_of_body
        module procedure velocity_alike
        module procedure velocity_of_bodies
    end interface angular_velocity

    !> m = I omega, both in body axes: angular_momentum(body, omega); shapes as for `angular_velocity`.
    interface angular_momentum
        module procedure momentum_of_body
        module procedure momentum_alike
        module procedure momentum_of_bodies
    end interface angular_momentum

    !> From body to space: quat_rotate(q, v) = E(q) v for an attitude q(4) of norm one and a vector v(3), or
    !> q(4, n) and v(3, n).
    interface quat_rotate
        procedure rotate_one
        module procedure rotate_many
    end interface quat_rotate

    !> From space to body: quat_rotate_back(q, v) = E(q)^T v; shapes as for `quat_rotate`.
    interface quat_rotate_back
        module procedure rotate_back_one
        module procedure rotate_back_many
    end interface quat_rotate_back

    !> The quaternion momentum p4 = 2 q (0, m), conjugate to q, of a unit quaternion q(4) and m(3) in body
    !> axes, or of q(4, n) and m(3, n): quat_momentum(q, m).
    interface quat_momentum
        module procedure quat_momentum_one
        module procedure quat_momentum_many
    end interface quat_momentum

    !> The inverse, momentum_from_quat(q, p4), is the vector part of q* p4/2, for a unit quaternion q. The
    !> component of p4 along q, 0 in an exact run, is dropped.
    interface momentum_from_quat
        module procedure momentum_from_quat_one
        module procedure momentum_from_quat_many
    end interface momentum_from_quat

contains

    !> I^-1 as a matrix in body axes, or I itself; NaN for a body that could not be made.
    pure function matrix_of(core, inverse) result(matrix)
        type(body_core), intent(in) :: core
        logical, intent(in) :: inverse
        real(wp) :: matrix(3, 3)
        real(wp) :: d(3), axes(3, 3)
        integer :: k

        d = core%moments
        if (core%status /= status_ok) then
            d = ieee_value(d, ieee_quiet_nan)
        else if (inverse) then
            where (d > 0.0_wp) d = 1/d
        end if
        axes = axes_of(core)
        do k = 1, 3
            matrix(:, k) = d*axes(k, :)
        end do
        matrix = matmul(axes, matrix)
    end function matrix_of

    !> I^-1 v or I v of one body, without a matrix where the axes are principal.
    pure function times_inertia(core, inverse, v) result(w)
        type(body_core), intent(in) :: core
        logical, intent(in) :: inverse
        real(wp), intent(in) :: v(3)
        real(wp) :: w(3)

        if (core%status /= status_ok) then
            w = ieee_value(w, ieee_quiet_nan)
        else if (inverse) then
            w = angular_response(core, v)
        else if (core%needs_rotation) then
            w = matmul(matrix_of(core, inverse), v)
        else
            w = core%moments*v
        end if
    end function times_inertia

    !> matrix v of each column.
    pure function times_matrix(matrix, v) result(w)
        real(wp), intent(in) :: matrix(3, 3)
        real(wp), intent(in), contiguous :: v(:, :)
        real(wp) :: w(3, size(v, 2))
        integer :: i

        if (size(v, 1) /= 3) then
            w = ieee_value(w, ieee_quiet_nan)
            return
        end if
        do i = 1, size(v, 2)
            w(1, i) = matrix(1, 1)*v(1, i) + matrix(1, 2)*v(2, i) + matrix(1, 3)*v(3, i)
            w(2, i) = matrix(2, 1)*v(1, i) + matrix(2, 2)*v(2, i) + matrix(2, 3)*v(3, i)
            w(3, i) = matrix(3, 1)*v(1, i) + matrix(3, 2)*v(2, i) + matrix(3, 3)*v(3, i)
        end do
    end function times_matrix

    !> I^-1 v or I v of each body.
    pure function times_inertias(body, inverse, v) result(w)
        type(rigid_body), intent(in) :: body(:)
        logical, intent(in) :: inverse
        real(wp), intent(in) :: v(:, :)
        real(wp) :: w(3, size(v, 2))
        integer :: i

        if (size(v, 1) /= 3 .or. size(body) /= size(v, 2)) then
            w = ieee_value(w, ieee_quiet_nan)
            return
        end if
        do i = 1, size(v, 2)
            w(:, i) = times_inertia(core_of(body(i)), inverse, v(:, i))
        end do
    end function times_inertias

    !> omega of one body.
    pure function velocity_of_body(body, m) result(omega)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: m(3)
        real(wp) :: omega(3)

        omega = times_inertia(core_of(body), .true., m)
    end function velocity_of_body

    !> omega of n bodies that are alike.
    pure function velocity_alike(body, m) result(omega)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in), contiguous :: m(:, :)
        real(wp) :: omega(3, size(m, 2))

        omega = times_matrix(matrix_of(core_of(body), .true.), m)
    end function velocity_alike

    !> omega of n bodies.
    pure function velocity_of_bodies(body, m) result(omega)
        type(rigid_body), intent(in) :: body(:)
        real(wp), intent(in) :: m(:, :)
        real(wp) :: omega(3, size(m, 2))

        omega = times_inertias(body, .true., m)
    end function velocity_of_bodies

    !> m of one body.
    pure function momentum_of_body(body, omega) result(m)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: omega(3)
        real(wp) :: m(3)

        m = times_inertia(core_of(body), .false., omega)
    end function momentum_of_body

    !> m of n bodies that are alike.
    pure function momentum_alike(body, omega) result(m)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in), contiguous :: omega(:, :)
        real(wp) :: m(3, size(omega, 2))

        m = times_matrix(matrix_of(core_of(body), .false.), omega)
    end function momentum_alike

    !> m of n bodies.
    pure function momentum_of_bodies(body, omega) result(m)
        type(rigid_body), intent(in) :: body(:)
        real(wp), intent(in) :: omega(:, :)
        real(wp) :: m(3, size(omega, 2))

        m = times_inertias(body, .false., omega)
    end function momentum_of_bodies

    !> E(q)^T v.
    pure function rotate_back_one(q, v) result(w)
        real(wp), intent(in) :: q(4), v(3)
        real(wp) :: w(3)

        w = rotate_one(quat_conjugate(q), v)
    end function rotate_back_one

    !> E(q) v of each column.
    pure function rotate_many(q, v) result(w)
        real(wp), intent(in), contiguous :: q(:, :), v(:, :)
        real(wp) :: w(3, size(v, 2))

        call rotate_all(1.0_wp, q, v, w)
    end function rotate_many

    !> E(q)^T v of each column.
    pure function rotate_back_many(q, v) result(w)
        real(wp), intent(in), contiguous :: q(:, :), v(:, :)
        real(wp) :: w(3, size(v, 2))

        call rotate_all(-1.0_wp, q, v, w)
    end function rotate_back_many

    !> E(q) v, or with sense = -1 the rotation back. With t = 2 q x v it is v + q0 t + q x t.
    pure subroutine rotate_all(sense, q, v, w)
        real(wp), intent(in) :: sense
        real(wp), intent(in), contiguous :: q(:, :), v(:, :)
        real(wp), intent(out), contiguous :: w(:, :)
        real(wp) :: nan, two, q0, t1, t2, t3
        integer :: i

        if (size(q, 1) /= 4 .or. size(v, 1) /= 3 .or. size(q, 2) /= size(v, 2)) then
            w = ieee_value(w, ieee_quiet_nan)
            return
        end if
        nan = ieee_value(nan, ieee_quiet_nan)
        do i = 1, size(v, 2)
            two = two_or_nan(q(1, i), q(2, i), q(3, i), q(4, i), nan)
            q0 = sense*q(1, i)
            t1 = two*(q(3, i)*v(3, i) - q(4, i)*v(2, i))
            t2 = two*(q(4, i)*v(1, i) - q(2, i)*v(3, i))
            t3 = two*(q(2, i)*v(2, i) - q(3, i)*v(1, i))
            w(1, i) = v(1, i) + (q0*t1 + (q(3, i)*t3 - q(4, i)*t2))
            w(2, i) = v(2, i) + (q0*t2 + (q(4, i)*t1 - q(2, i)*t3))
            w(3, i) = v(3, i) + (q0*t3 + (q(2, i)*t2 - q(3, i)*t1))
        end do
    end subroutine rotate_all

    !> 2, or NaN unless q is of norm one: a factor, so that loops need not branch.
    pure function two_or_nan(q0, q1, q2, q3, nan) result(two)
        real(wp), intent(in) :: q0, q1, q2, q3, nan
        real(wp) :: two
        real(wp) :: square

        square = (q0*q0 + q1*q1) + (q2*q2 + q3*q3)
        two = merge(2.0_wp, nan, square >= (1 - unit_tolerance)**2 .and. square <= (1 + unit_tolerance)**2)
    end function two_or_nan

    !> p4 of one body.
    pure function quat_momentum_one(q, m) result(p4)
        real(wp), intent(in) :: q(4), m(3)
        real(wp) :: p4(4)

        p4 = reshape(quat_momentum_many(reshape(q, [4, 1]), reshape(m, [3, 1])), [4])
    end function quat_momentum_one

    !> p4 of each column.
    pure function quat_momentum_many(q, m) result(p4)
        real(wp), intent(in), contiguous :: q(:, :), m(:, :)
        real(wp) :: p4(4, size(m, 2))
        real(wp) :: nan, two
        integer :: i

        if (size(q, 1) /= 4 .or. size(m, 1) /= 3 .or. size(q, 2) /= size(m, 2)) then
            p4 = ieee_value(p4, ieee_quiet_nan)
            return
        end if
        nan = ieee_value(nan, ieee_quiet_nan)
        do i = 1, size(m, 2)
            two = two_or_nan(q(1, i), q(2, i), q(3, i), q(4, i), nan)
            p4(1, i) = -two*(q(2, i)*m(1, i) + q(3, i)*m(2, i) + q(4, i)*m(3, i))
            p4(2, i) = two*(q(1, i)*m(1, i) + (q(3, i)*m(3, i) - q(4, i)*m(2, i)))
            p4(3, i) = two*(q(1, i)*m(2, i) + (q(4, i)*m(1, i) - q(2, i)*m(3, i)))
            p4(4, i) = two*(q(1, i)*m(3, i) + (q(2, i)*m(2, i) - q(3, i)*m(1, i)))
        end do
    end function quat_momentum_many

    !> m of one body.
    pure function momentum_from_quat_one(q, p4) result(m)
        real(wp), intent(in) :: q(4), p4(4)
        real(wp) :: m(3)

        m = reshape(momentum_from_quat_many(reshape(q, [4, 1]), reshape(p4, [4, 1])), [3])
    end function momentum_from_quat_one

    !> m of each column.
    pure function momentum_from_quat_many(q, p4) result(m)
        real(wp), intent(in), contiguous :: q(:, :), p4(:, :)
        real(wp) :: m(3, size(p4, 2))
        real(wp) :: nan, half
        integer :: i

        if (size(q, 1) /= 4 .or. size(p4, 1) /= 4 .or. size(q, 2) /= size(p4, 2)) then
            m = ieee_value(m, ieee_quiet_nan)
            return
        end if
        nan = ieee_value(nan, ieee_quiet_nan)
        do i = 1, size(p4, 2)
            half = 0.25_wp*two_or_nan(q(1, i), q(2, i), q(3, i), q(4, i), nan)
            m(1, i) = half*((q(1, i)*p4(2, i) - p4(1, i)*q(2, i)) + (q(4, i)*p4(3, i) - q(3, i)*p4(4, i)))
            m(2, i) = half*((q(1, i)*p4(3, i) - p4(1, i)*q(3, i)) + (q(2, i)*p4(4, i) - q(4, i)*p4(2, i)))
            m(3, i) = half*((q(1, i)*p4(4, i) - p4(1, i)*q(4, i)) + (q(3, i)*p4(2, i) - q(2, i)*p4(3, i)))
        end do
    end function momentum_from_quat_many

end module frb_frames
