!> More ways to call `free_flow` for many bodies, each with its own time h(n) or with matrices, and
!> `free_flow_columns` for states that are columns. Status, accuracy and threads as in frb_free_flow.
module frb_free_flow_many
    use frb_flow_bodies, only: flow_many, flow_columns
    use frb_free_flow, only: rigid_body, core_alone, cores_of, turn_matrix
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: return_or_stop, status_ok, status_bad_count
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: free_flow, free_flow_columns

    !> `call free_flow(body, h, m [, q or a] [, stat])`: body or body(n), h or h(n), m(3,n), q(4,n), a(3,3,n).
    interface free_flow
        module procedure momenta_of_body_at_times
        module procedure momenta_of_bodies_at_times
        module procedure quaternions_of_body_at_times
        module procedure quaternions_of_bodies_at_times
        module procedure matrices_of_body_at_time
        module procedure matrices_of_body_at_times
        module procedure matrices_of_bodies_at_time
        module procedure matrices_of_bodies_at_times
    end interface free_flow

    !> `call free_flow_columns(body, h, m1, m2, m3 [, q0, q1, q2, q3] [, stat])`: body or body(n), h or h(n),
    !> all others (n); the q all or none. Contiguous vectors are not copied: the fastest way.
    interface free_flow_columns
        module procedure columns_of_body_at_time
        module procedure columns_of_body_at_times
        module procedure columns_of_bodies_at_time
        module procedure columns_of_bodies_at_times
    end interface free_flow_columns

    integer, parameter :: chunk = 1024      !! matrices turned at a time

contains

    !> The momenta of n equal bodies, by the times h(n).
    subroutine momenta_of_body_at_times(body, h, m, stat)
        type(rigid_body), intent(in), target :: body
        real(wp), intent(in) :: h(:)
        real(wp), intent(inout), contiguous :: m(:, :)
        integer, intent(out), optional :: stat

        call flow_many(core_alone(body), .true., h, size(h), m, stat)
    end subroutine momenta_of_body_at_times

    !> The momenta of the n bodies body(n), by the times h(n).
    subroutine momenta_of_bodies_at_times(body, h, m, stat)
        type(rigid_body), intent(in), target :: body(:)
        real(wp), intent(in) :: h(:)
        real(wp), intent(inout), contiguous :: m(:, :)
        integer, intent(out), optional :: stat

        call flow_many(cores_of(body), .false., h, count_of(body, h), m, stat)
    end subroutine momenta_of_bodies_at_times

    !> The momenta and quaternions of n equal bodies, by the times h(n).
    subroutine quaternions_of_body_at_times(body, h, m, q, stat)
        type(rigid_body), intent(in), target :: body
        real(wp), intent(in) :: h(:)
        real(wp), intent(inout), contiguous :: m(:, :), q(:, :)
        integer, intent(out), optional :: stat

        call flow_many(core_alone(body), .true., h, size(h), m, stat, q)
    end subroutine quaternions_of_body_at_times

    !> The momenta and quaternions of the n bodies body(n), by the times h(n).
    subroutine quaternions_of_bodies_at_times(body, h, m, q, stat)
        type(rigid_body), intent(in), target :: body(:)
        real(wp), intent(in) :: h(:)
        real(wp), intent(inout), contiguous :: m(:, :), q(:, :)
        integer, intent(out), optional :: stat

        call flow_many(cores_of(body), .false., h, count_of(body, h), m, stat, q)
    end subroutine quaternions_of_bodies_at_times

    !> The momenta and matrices of n equal bodies, by h.
    subroutine matrices_of_body_at_time(body, h, m, a, stat)
        type(rigid_body), intent(in), target :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :), a(:, :, :)
        integer, intent(out), optional :: stat

        call matrices(core_alone(body), .true., [h], size(m, 2), m, a, stat)
    end subroutine matrices_of_body_at_time

    !> The momenta and matrices of n equal bodies, by the times h(n).
    subroutine matrices_of_body_at_times(body, h, m, a, stat)
        type(rigid_body), intent(in), target :: body
        real(wp), intent(in) :: h(:)
        real(wp), intent(inout), contiguous :: m(:, :), a(:, :, :)
        integer, intent(out), optional :: stat

        call matrices(core_alone(body), .true., h, size(h), m, a, stat)
    end subroutine matrices_of_body_at_times

    !> The momenta and matrices of the n bodies body(n), by h.
    subroutine matrices_of_bodies_at_time(body, h, m, a, stat)
        type(rigid_body), intent(in), target :: body(:)
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :), a(:, :, :)
        integer, intent(out), optional :: stat

        call matrices(cores_of(body), .false., [h], size(body), m, a, stat)
    end subroutine matrices_of_bodies_at_time

    !> The momenta and matrices of the n bodies body(n), by the times h(n).
    subroutine matrices_of_bodies_at_times(body, h, m, a, stat)
        type(rigid_body), intent(in), target :: body(:)
        real(wp), intent(in) :: h(:)
        real(wp), intent(inout), contiguous :: m(:, :), a(:, :, :)
        integer, intent(out), optional :: stat

        call matrices(cores_of(body), .false., h, count_of(body, h), m, a, stat)
    end subroutine matrices_of_bodies_at_times

    !> The columns of n equal bodies, by h.
    subroutine columns_of_body_at_time(body, h, m1, m2, m3, q0, q1, q2, q3, stat)
        type(rigid_body), intent(in), target :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        real(wp), intent(inout), optional :: q0(:), q1(:), q2(:), q3(:)
        integer, intent(out), optional :: stat
        integer :: code

        call flow_columns(core_alone(body), .true., [h], size(m1), m1, m2, m3, code, q0, q1, q2, q3)
        call return_or_stop(code, 'free_flow_columns', stat)
    end subroutine columns_of_body_at_time

    !> The columns of n equal bodies, by the times h(n).
    subroutine columns_of_body_at_times(body, h, m1, m2, m3, q0, q1, q2, q3, stat)
        type(rigid_body), intent(in), target :: body
        real(wp), intent(in) :: h(:)
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        real(wp), intent(inout), optional :: q0(:), q1(:), q2(:), q3(:)
        integer, intent(out), optional :: stat
        integer :: code

        call flow_columns(core_alone(body), .true., h, size(h), m1, m2, m3, code, q0, q1, q2, q3)
        call return_or_stop(code, 'free_flow_columns', stat)
    end subroutine columns_of_body_at_times

    !> The columns of the n bodies body(n), by h.
    subroutine columns_of_bodies_at_time(body, h, m1, m2, m3, q0, q1, q2, q3, stat)
        type(rigid_body), intent(in), target :: body(:)
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        real(wp), intent(inout), optional :: q0(:), q1(:), q2(:), q3(:)
        integer, intent(out), optional :: stat
        integer :: code

        call flow_columns(cores_of(body), .false., [h], size(body), m1, m2, m3, code, q0, q1, q2, q3)
        call return_or_stop(code, 'free_flow_columns', stat)
    end subroutine columns_of_bodies_at_time

    !> The columns of the n bodies body(n), by the times h(n).
    subroutine columns_of_bodies_at_times(body, h, m1, m2, m3, q0, q1, q2, q3, stat)
        type(rigid_body), intent(in), target :: body(:)
        real(wp), intent(in) :: h(:)
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        real(wp), intent(inout), optional :: q0(:), q1(:), q2(:), q3(:)
        integer, intent(out), optional :: stat
        integer :: code

        call flow_columns(cores_of(body), .false., h, count_of(body, h), m1, m2, m3, code, q0, q1, q2, q3)
        call return_or_stop(code, 'free_flow_columns', stat)
    end subroutine columns_of_bodies_at_times

    !> n states with matrices: the turns of a chunk as quaternions, then the matrices by them. A matrix that
    !> is not finite is refused as a quaternion of norm zero is.
    subroutine matrices(core, alike, h, n, m, a, stat)
        type(body_core), intent(in) :: core(:)
        logical, intent(in) :: alike            !! core(1) is meant for all, whatever n
        real(wp), intent(in), contiguous :: h(:)
        integer, intent(in) :: n
        real(wp), intent(inout), contiguous :: m(:, :), a(:, :, :)
        integer, intent(out), optional :: stat
        real(wp) :: q(4, chunk)
        integer :: code, refused, first, last, count, b, t, i

        code = status_bad_count
        if (any(size(core) == [1, n]) .and. any(size(h) == [1, n]) .and. all(shape(m) == [3, n]) &
            .and. all(shape(a) == [3, 3, n])) then
            code = status_ok
            !$omp parallel do if (n >= 4*chunk) private(q, last, count, b, t, i, refused) &
            !$omp& reduction(max: code)
            do first = 1, n, chunk
                count = min(chunk, n - first + 1)
                last = first + count - 1
                b = merge(count, 1, size(core) > 1)
                t = merge(count, 1, size(h) > 1)
                do i = 1, count
                    q(:, i) = 0.0_wp
                    if (all(ieee_is_finite(a(:, :, first + i - 1)))) q(1, i) = 1.0_wp
                end do
                associate (c => merge(first, 1, b > 1), s => merge(first, 1, t > 1))
                    call flow_many(core(c:c + b - 1), alike, h(s:s + t - 1), count, m(:, first:last), &
                                   refused, q(:, :count))
                end associate
                code = max(code, refused)
                do i = 1, count
                    if (any(abs(q(2:4, i)) > 0.0_wp)) call turn_matrix(q(:, i), a(:, :, first + i - 1))
                end do
            end do
            !$omp end parallel do
        end if
        call return_or_stop(code, 'free_flow', stat)
    end subroutine matrices

    !> The number of bodies that have a time each; -1, which is refused, if there are not as many times.
    pure function count_of(body, h) result(n)
        type(rigid_body), intent(in) :: body(:)
        real(wp), intent(in) :: h(:)
        integer :: n

        n = merge(size(body), -1, size(body) == size(h))
    end function count_of

end module frb_free_flow_many
