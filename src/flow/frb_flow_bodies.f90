!> Many free bodies at once: the bodies of a block share SIMD lanes, blocks are shared among threads.
module frb_flow_bodies
    use frb_flow_blocks, only: block_of_bodies, set_bodies, step_block, whole
    use frb_flow_lanes, only: lanes, workspace
    use frb_flow_limits, only: period_limit, plain_largest, plain_smallest
    use frb_flow_one, only: flow_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: return_or_stop, status_ok, status_bad_count, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
    use, intrinsic :: iso_c_binding, only: c_size_t
    implicit none
    private

    public :: flow_many, flow_rows, flow_columns

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
    !> BLAS: ldm and ldq are the distances from a body to the next. The blocks are independent: with -fopenmp
    !> they are shared among the threads. What becomes of a body does not depend on the others: the same bits
    !> for any threads and parts of a batch. (So one body takes a block too, though a call for it alone is
    !> faster.)
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
        logical :: blocks_differ
        integer :: first, count, refused

        code = status_bad_count
        if (all(size(body) /= [1, n]) .or. all(size(h) /= [1, n])) return
        code = status_ok
        if (size(body) == 1) code = body(1)%status
        if (size(h) == 1 .and. code == status_ok) then
            if (.not. ieee_is_finite(h(1))) code = status_bad_time
        end if
        if (code /= status_ok .or. n == 0) return
        refused = status_ok
        blocks_differ = max(size(body), size(h)) > 1
        if (.not. blocks_differ) call set_bodies(body, alike, h, 1, min(n, lanes), block)
        !$omp parallel do if (n >= 64*lanes) firstprivate(block) private(count) reduction(max: refused)
        do first = 1, n, lanes
            count = min(lanes, n - first + 1)
            if (blocks_differ) call set_bodies(body, alike, h, first, count, block)
            call flow_block(body, h, first, count, block, ldm, ldq, m1, m2, m3, refused, q0, q1, q2, q3)
        end do
        !$omp end parallel do
        code = refused
    end subroutine flow_vectors

    !> One block. Bodies that the lanes cannot move are moved by flow_body.
    subroutine flow_block(body, h, first, count, block, ldm, ldq, m1, m2, m3, refused, q0, q1, q2, q3)
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: first, count
        integer(c_size_t), intent(in) :: ldm, ldq
        type(block_of_bodies), intent(inout) :: block
        real(wp), intent(inout) :: m1(0:*), m2(0:*), m3(0:*)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q0(0:*), q1(0:*), q2(0:*), q3(0:*)
        type(workspace) :: work
        real(wp) :: m(lanes, 3), total(lanes)
        logical :: all_moved
        integer :: l, high, step

        if (present(q0)) then
            call measure_attitudes(first, count, ldq, q0, q1, q2, q3, total)
        else
            total(:count) = 0.0_wp
        end if
        call load_momenta(first, count, whole(count), total, ldm, m1, m2, m3, m)
        if (.not. block%all_plain) call stop_lanes(whole(count), block%lane, m)
        call step_block(whole(count), present(q0), block, m(:, 1), m(:, 2), m(:, 3), work, all_moved)
        step = merge(count, 1, all_moved)
        do l = 1, count, step
            high = l + step - 1
            if (all_moved .or. work%size(l) <= period_limit) then
                associate (d => work%d, w => work%w, c => block%column)
                    call add(first, l, high, m, d(:, c(1)), d(:, c(2)), d(:, c(3)), ldm, m1, m2, m3)
                    if (.not. present(q0)) cycle
                    call turn_attitudes(first, l, high, work%w0, w(:, c(1)), w(:, c(2)), w(:, c(3)), &
                                        ldq, q0, q1, q2, q3)
                end associate
            else
                call flow_single(body, h, first + l - 1, ldm, ldq, m1, m2, m3, refused, q0, q1, q2, q3)
            end if
        end do
    end subroutine flow_block

    !> A quarter of the sums of sizes of components; `plain_largest` for NaN and for attitudes near zero.
    pure subroutine measure_attitudes(first, count, ldq, q0, q1, q2, q3, total)
        integer, intent(in) :: first, count
        integer(c_size_t), intent(in) :: ldq
        real(wp), intent(in) :: q0(0:*), q1(0:*), q2(0:*), q3(0:*)
        real(wp), intent(out) :: total(lanes)
        real(wp) :: sizes
        integer(c_size_t) :: k
        integer :: l

        do l = 1, count
            k = (first - 2 + l)*ldq
            sizes = (0.25_wp*abs(q0(k)) + 0.25_wp*abs(q1(k))) + (0.25_wp*abs(q2(k)) + 0.25_wp*abs(q3(k)))
            sizes = merge(plain_largest, sizes, ieee_is_nan(sizes))     ! comparing a NaN would raise a flag
            total(l) = merge(plain_largest, 0.25_wp*sizes, sizes < plain_smallest)
        end do
    end subroutine measure_attitudes

    !> Momenta as columns; lanes up to a whole vector repeat the last one. Where the components of the state
    !> are not finite or near overflow, the momentum is 0: the lanes do not move it.
    pure subroutine load_momenta(first, count, full, total, ldm, m1, m2, m3, m)
        integer, intent(in) :: first, count, full
        integer(c_size_t), intent(in) :: ldm
        real(wp), intent(in) :: total(lanes)        !! of the attitudes
        real(wp), intent(in) :: m1(0:*), m2(0:*), m3(0:*)
        real(wp), intent(out) :: m(lanes, 3)
        real(wp) :: x1, x2, x3, sizes
        integer(c_size_t) :: k
        integer :: l

        do l = 1, count
            k = (first - 2 + l)*ldm
            x1 = m1(k)
            x2 = m2(k)
            x3 = m3(k)
            sizes = (0.25_wp*abs(x1) + 0.25_wp*abs(x2)) + (0.25_wp*abs(x3) + total(l))
            sizes = merge(plain_largest, sizes, ieee_is_nan(sizes))
            m(l, 1) = merge(x1, 0.0_wp, sizes < 0.25_wp*plain_largest)
            m(l, 2) = merge(x2, 0.0_wp, sizes < 0.25_wp*plain_largest)
            m(l, 3) = merge(x3, 0.0_wp, sizes < 0.25_wp*plain_largest)
        end do
        m(count + 1:full, 1) = m(count, 1)
        m(count + 1:full, 2) = m(count, 2)
        m(count + 1:full, 3) = m(count, 3)
    end subroutine load_momenta

    !> The lanes whose bodies or times are not plain get the momentum 0.
    pure subroutine stop_lanes(full, lane, m)
        integer, intent(in) :: full
        real(wp), intent(in) :: lane(lanes)
        real(wp), intent(inout) :: m(lanes, 3)
        integer :: l

        do l = 1, full
            if (.not. abs(lane(l)) > 0.5_wp) m(l, :) = 0.0_wp
        end do
    end subroutine stop_lanes

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

    !> The momenta m + d of lanes from `low` to `high`.
    pure subroutine add(first, low, high, m, d1, d2, d3, ldm, m1, m2, m3)
        integer, intent(in) :: first, low, high
        integer(c_size_t), intent(in) :: ldm
        real(wp), intent(in) :: m(lanes, 3), d1(lanes), d2(lanes), d3(lanes)
        real(wp), intent(inout) :: m1(0:*), m2(0:*), m3(0:*)
        integer(c_size_t) :: k
        integer :: l

        !GCC$ ivdep
        do l = low, high
            k = (first - 2 + l)*ldm
            m1(k) = m(l, 1) + d1(l)
            m2(k) = m(l, 2) + d2(l)
            m3(k) = m(l, 3) + d3(l)
        end do
    end subroutine add

    !> The attitudes q + q w of lanes from `low` to `high`.
    pure subroutine turn_attitudes(first, low, high, w0, w1, w2, w3, ldq, q0, q1, q2, q3)
        integer, intent(in) :: first, low, high
        integer(c_size_t), intent(in) :: ldq
        real(wp), intent(in) :: w0(lanes), w1(lanes), w2(lanes), w3(lanes)
        real(wp), intent(inout) :: q0(0:*), q1(0:*), q2(0:*), q3(0:*)
        integer(c_size_t) :: k
        integer :: l

        !GCC$ ivdep
        do l = low, high
            k = (first - 2 + l)*ldq
            call turn(w0(l), w1(l), w2(l), w3(l), q0(k), q1(k), q2(k), q3(k))
        end do
    end subroutine turn_attitudes

    include 'turn_formulas.inc'

end module frb_flow_bodies
