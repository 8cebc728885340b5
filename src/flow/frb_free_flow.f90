!> The exact flow of the free rigid body, `free_flow`: momentum only, with a quaternion, with a matrix; for one
!> body and for many.
module frb_free_flow
    use frb_flow_core, only: flow_core
    use frb_inertia, only: rigid_body
    use frb_kinds, only: wp
    use frb_rotations, only: norm3, quat_conjugate, quat_product, quat_rotate, quat_to_matrix
    use frb_status, only: conclude, status_ok, status_bad_momentum, status_bad_attitude, status_bad_time, &
        status_bad_count
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: free_flow

    interface free_flow
        module procedure flow_momentum
        module procedure flow_quaternion
        module procedure flow_matrix
        module procedure flow_momenta
        module procedure flow_quaternions
        module procedure flow_momenta_bodies
        module procedure flow_quaternions_bodies
    end interface free_flow

contains

    !> Momentum m of a free body after the time h, in place.
    subroutine flow_momentum(body, h, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer, intent(out), optional :: stat
        real(wp) :: q(4)
        integer :: code

        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call step(body, h, m, q, 0, code)
        call conclude(code, 'free_flow', stat)
    end subroutine flow_momentum

    !> Momentum m and attitude q of a free body after the time h, in place.
    subroutine flow_quaternion(body, h, m, q, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        real(wp), intent(inout) :: q(4)
        integer, intent(out), optional :: stat
        integer :: code

        call step(body, h, m, q, 1, code)
        call conclude(code, 'free_flow', stat)
    end subroutine flow_quaternion

    !> Momentum m and attitude matrix a of a free body after the time h, in place.
    subroutine flow_matrix(body, h, m, a, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        real(wp), intent(inout) :: a(3, 3)
        integer, intent(out), optional :: stat
        real(wp) :: q(4)
        integer :: code

        code = status_bad_attitude
        if (all(ieee_is_finite(a))) then
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call step(body, h, m, q, 1, code)
            if (code == status_ok) a = matmul(a, quat_to_matrix(q))
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_matrix

    !> Momenta m(3, n) of n equal bodies after the time h, in place.
    subroutine flow_momenta(body, h, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(:, :)
        integer, intent(out), optional :: stat
        real(wp) :: q(4)
        integer :: code, i, one

        code = status_bad_count
        if (size(m, 1) == 3) then
            code = status_ok
            do i = 1, size(m, 2)
                q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
                call step(body, h, m(:, i), q, 0, one)
                if (one /= status_ok) code = one
            end do
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_momenta

    !> Momenta m(3, n) and attitudes q(4, n) of n equal bodies after the time h, in place.
    subroutine flow_quaternions(body, h, m, q, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(:, :)
        real(wp), intent(inout) :: q(:, :)
        integer, intent(out), optional :: stat
        integer :: code, i, one

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(q, 1) == 4 .and. size(m, 2) == size(q, 2)) then
            code = status_ok
            do i = 1, size(m, 2)
                call step(body, h, m(:, i), q(:, i), 1, one)
                if (one /= status_ok) code = one
            end do
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_quaternions

    !> Momenta m(3, n) of the bodies body(n) after the time h, in place.
    subroutine flow_momenta_bodies(body, h, m, stat)
        type(rigid_body), intent(in) :: body(:)
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(:, :)
        integer, intent(out), optional :: stat
        real(wp) :: q(4)
        integer :: code, i, one

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(m, 2) == size(body)) then
            code = status_ok
            do i = 1, size(m, 2)
                q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
                call step(body(i), h, m(:, i), q, 0, one)
                if (one /= status_ok) code = one
            end do
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_momenta_bodies

    !> Momenta m(3, n) and attitudes q(4, n) of the bodies body(n) after the time h, in place.
    subroutine flow_quaternions_bodies(body, h, m, q, stat)
        type(rigid_body), intent(in) :: body(:)
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(:, :)
        real(wp), intent(inout) :: q(:, :)
        integer, intent(out), optional :: stat
        integer :: code, i, one

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(q, 1) == 4 .and. size(m, 2) == size(q, 2) &
            .and. size(m, 2) == size(body)) then
            code = status_ok
            do i = 1, size(m, 2)
                call step(body(i), h, m(:, i), q(:, i), 1, one)
                if (one /= status_ok) code = one
            end do
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_quaternions_bodies

    !> One step with its checks; the principal rotation is folded in and out.
    subroutine step(body, h, m, q, mode, code)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(in) :: mode
        integer, intent(out) :: code

        code = body%status
        if (code /= status_ok) return
        if (.not. ieee_is_finite(h)) then
            code = status_bad_time
        else if (.not. all(ieee_is_finite(m))) then
            code = status_bad_momentum
        else if (.not. all(ieee_is_finite(q))) then
            code = status_bad_attitude
        end if
        if (code /= status_ok) return
        if (norm3(m) <= 0.0_wp) return
        if (body%turned) then
            m = quat_rotate(quat_conjugate(body%axes_q), m)
            q = quat_product(q, body%axes_q)
            call flow_core(body, h, m, q, mode)
            m = quat_rotate(body%axes_q, m)
            q = quat_product(q, quat_conjugate(body%axes_q))
        else
            call flow_core(body, h, m, q, mode)
        end if
    end subroutine step

end module frb_free_flow
