!> Many free bodies at once: the bodies of a block share SIMD lanes, blocks are shared among threads.
module frb_flow_bodies
    use frb_flow_blocks, only: block_of_bodies, set_bodies, step_block, find_classes, whole
    use frb_flow_lanes, only: lanes, classes, workspace
    use frb_flow_limits, only: largest_bits, smallest_bits
    use frb_flow_one, only: flow_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: return_or_stop, status_ok, status_bad_count, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    use, intrinsic :: iso_c_binding, only: c_size_t
    implicit none
    private

    public :: flow_many, flow_rows, flow_columns

    integer, parameter :: group = 16*lanes      !! bodies that a thread takes at a time
    integer, parameter :: first_of_all(lanes) = 1

    !> Bodies that wait, and their states, by class; those of class `classes` + 1 are moved one by one.
    type :: waiting_states
        integer :: count(classes + 1), number(lanes, classes + 1)
        real(wp) :: m(lanes, 3, classes + 1), q(lanes, 4, classes + 1)
    end type waiting_states

contains

    !> Advances n bodies with states in rows, m(3, n) and q(4, n): see flow_vectors. Stops without `stat`.
    subroutine flow_many(body, alike, h, n, m, stat, q)
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: n
        real(wp), intent(inout), contiguous :: m(:, :)
        integer, intent(out), optional :: stat
        real(wp), intent(inout), contiguous, optional :: q(:, :)
        integer :: code

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(m, 2) == n) then
            if (.not. present(q)) then
                call flow_rows(body, alike, h, n, 3_c_size_t, 4_c_size_t, m, code)
            else if (size(q, 1) == 4 .and. size(q, 2) == n) then
                call flow_rows(body, alike, h, n, 3_c_size_t, 4_c_size_t, m, code, q)
            end if
        end if
        call return_or_stop(code, 'free_flow', stat)
    end subroutine flow_many

    !> The same for rows of any lengths.
    subroutine flow_rows(body, alike, h, n, ldm, ldq, m, code, q)
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: n
        integer(c_size_t), intent(in) :: ldm, ldq
        real(wp), intent(inout) :: m(ldm, *)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(ldq, *)

        if (present(q)) then
            call flow_vectors(body, alike, h, n, ldm, ldq, m(1, 1), m(2, 1), m(3, 1), code, &
                              q(1, 1), q(2, 1), q(3, 1), q(4, 1))
        else
            call flow_vectors(body, alike, h, n, ldm, ldq, m(1, 1), m(2, 1), m(3, 1), code)
        end if
    end subroutine flow_rows

    !> The same for states as columns; the q all or none.
    subroutine flow_columns(body, alike, h, n, m1, m2, m3, code, q0, q1, q2, q3)
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: n
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q0(:), q1(:), q2(:), q3(:)

        code = status_bad_count
        if (any([size(m1), size(m2), size(m3)] /= n)) return
        if (present(q0) .and. present(q1) .and. present(q2) .and. present(q3)) then
            if (any([size(q0), size(q1), size(q2), size(q3)] /= n)) return
            call flow_vectors(body, alike, h, n, 1_c_size_t, 1_c_size_t, m1, m2, m3, code, q0, q1, q2, q3)
        else if (.not. (present(q0) .or. present(q1) .or. present(q2) .or. present(q3))) then
            call flow_vectors(body, alike, h, n, 1_c_size_t, 1_c_size_t, m1, m2, m3, code)
        end if
    end subroutine flow_columns

    !> Advances n bodies in blocks, one body per SIMD lane. The components of the states are vectors, as in
    !> BLAS: ldm and ldq are the distances from a body to the next. Groups of blocks are independent: with
    !> -fopenmp they are shared among the threads. What becomes of a body does not depend on the others: the
    !> same bits, but for the sign of 0, for any threads and parts of a batch. (So one body takes a block too,
    !> though a call for it alone is faster.)
    subroutine flow_vectors(body, alike, h, n, ldm, ldq, m1, m2, m3, code, q0, q1, q2, q3)
        type(body_core), intent(in) :: body(:)      !! one for all or n
        logical, intent(in) :: alike                !! body(1) is meant for all, whatever n
        real(wp), intent(in) :: h(:)                !! one for all or n
        integer, intent(in) :: n
        integer(c_size_t), intent(in) :: ldm, ldq
        real(wp), intent(inout) :: m1(0:*), m2(0:*), m3(0:*)
        integer, intent(out) :: code                !! the largest of those of the bodies
        real(wp), intent(inout), optional :: q0(0:*), q1(0:*), q2(0:*), q3(0:*)
        type(block_of_bodies) :: block
        integer :: first, refused

        code = status_bad_count
        if (all(size(body) /= [1, n]) .or. all(size(h) /= [1, n])) return
        code = status_ok
        if (size(body) == 1) code = body(1)%status
        if (size(h) == 1 .and. code == status_ok) then
            if (.not. ieee_is_finite(h(1))) code = status_bad_time
        end if
        if (code /= status_ok .or. n == 0) return
        refused = status_ok
        if (max(size(body), size(h)) == 1) call set_bodies(body, alike, h, first_of_all, min(n, lanes), block)
        !$omp parallel do if (n >= 4*group) firstprivate(block) reduction(max: refused)
        do first = 1, n, group
            call flow_group(body, alike, h, first, first + min(group - 1, n - first), block, ldm, ldq, m1, &
                            m2, m3, refused, q0, q1, q2, q3)
        end do
        !$omp end parallel do
        code = refused
    end subroutine flow_vectors

    !> Bodies from `low` to `high`. A step of a block takes as long for one lane as for all: so where a block
    !> needs steps of several classes, the class that half of it has steps at once, and the other bodies wait,
    !> as columns, for others of their class.
    subroutine flow_group(body, alike, h, low, high, block, ldm, ldq, m1, m2, m3, refused, q0, q1, q2, q3)
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: low, high
        type(block_of_bodies), intent(inout) :: block       !! set, if it is the same for all
        integer(c_size_t), intent(in) :: ldm, ldq
        real(wp), intent(inout) :: m1(0:*), m2(0:*), m3(0:*)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q0(0:*), q1(0:*), q2(0:*), q3(0:*)
        type(waiting_states) :: waiting
        type(workspace) :: work
        real(wp) :: m(lanes, 3), q(lanes, 4)
        integer :: first, count, done, moved, class, l, number(lanes)

        waiting%count = 0
        do first = low, high, lanes
            count = min(lanes, high - first + 1)
            if (max(size(body), size(h)) > 1) then
                do l = 1, count
                    number(l) = first - 1 + l
                end do
                call set_bodies(body, alike, h, number, count, block)
            end if
            call load(first, count, block, ldm, ldq, m1, m2, m3, m, q, q0, q1, q2, q3)
            call step_block(whole(count), present(q0), block, m(:, 1), m(:, 2), m(:, 3), work, done, moved)
            if (done > 0) call store(first, count, block%column, work, ldm, ldq, m, q, m1, m2, m3, q0, q1, &
                                     q2, q3)
            if (moved == whole(count)) cycle
            call find_classes(count, alike, work%size, number)
            do l = 1, count
                class = number(l)
                if (class == done) cycle
                associate (n => waiting%count(class))
                    n = n + 1
                    waiting%number(n, class) = first - 1 + l
                    waiting%m(n, :, class) = m(l, :)
                    if (present(q0)) waiting%q(n, :, class) = q(l, :)
                    if (n == lanes) call flow_class(body, alike, h, class, waiting, block, ldm, ldq, m1, &
                                                    m2, m3, refused, q0, q1, q2, q3)
                end associate
            end do
        end do
        do class = 1, classes + 1
            if (waiting%count(class) > 0) call flow_class(body, alike, h, class, waiting, block, ldm, ldq, &
                                                          m1, m2, m3, refused, q0, q1, q2, q3)
        end do
    end subroutine flow_group

    !> Advances the bodies of one class that wait.
    subroutine flow_class(body, alike, h, class, waiting, block, ldm, ldq, m1, m2, m3, refused, q0, q1, &
                          q2, q3)
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: class
        type(waiting_states), intent(inout) :: waiting
        type(block_of_bodies), intent(inout) :: block
        integer(c_size_t), intent(in) :: ldm, ldq
        real(wp), intent(inout) :: m1(0:*), m2(0:*), m3(0:*)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q0(0:*), q1(0:*), q2(0:*), q3(0:*)
        type(workspace) :: work
        integer :: done, moved, n, l

        n = waiting%count(class)
        waiting%count(class) = 0
        done = 0
        associate (number => waiting%number(:, class), m => waiting%m(:, :, class), &
                   q => waiting%q(:, :, class))
            if (class <= classes) then
                m(n + 1:, 1) = m(n, 1)
                m(n + 1:, 2) = m(n, 2)
                m(n + 1:, 3) = m(n, 3)
                if (max(size(body), size(h)) > 1) call set_bodies(body, alike, h, number, n, block)
                call step_block(whole(n), present(q0), block, m(:, 1), m(:, 2), m(:, 3), work, done, &
                                moved)
            end if
            if (done == class) then
                call scatter(number, n, block%column, work, ldm, ldq, m, q, m1, m2, m3, q0, q1, q2, q3)
            else
                do l = 1, n
                    call flow_single(body, h, number(l), ldm, ldq, m1, m2, m3, refused, q0, q1, q2, q3)
                end do
            end if
        end associate
    end subroutine flow_class

    !> Body number k by itself.
    subroutine flow_single(body, h, k, ldm, ldq, m1, m2, m3, refused, q0, q1, q2, q3)
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: k
        integer(c_size_t), intent(in) :: ldm, ldq
        real(wp), intent(inout) :: m1(0:*), m2(0:*), m3(0:*)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q0(0:*), q1(0:*), q2(0:*), q3(0:*)
        real(wp) :: m(3), q(4)
        integer(c_size_t) :: i, j
        integer :: code

        i = (k - 1)*ldm
        j = (k - 1)*ldq
        associate (its_body => body(min(size(body), k)), time => h(min(size(h), k)))
            m = [m1(i), m2(i), m3(i)]
            if (present(q0)) then
                q = [q0(j), q1(j), q2(j), q3(j)]
                call flow_body(its_body, time, m, code, q)
                q0(j) = q(1)
                q1(j) = q(2)
                q2(j) = q(3)
                q3(j) = q(4)
            else
                call flow_body(its_body, time, m, code)
            end if
        end associate
        m1(i) = m(1)
        m2(i) = m(2)
        m3(i) = m(3)
        refused = max(refused, code)
    end subroutine flow_single

    include 'block_states.inc'

    include 'turn_formulas.inc'

end module frb_flow_bodies
