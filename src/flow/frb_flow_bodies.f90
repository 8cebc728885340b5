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
    implicit none
    private

    public :: flow_many, flow_columns

contains

    !> Advances n bodies whose states are the rows m(3, n) and q(4, n), of any strides: see flow_columns.
    !> Stops without `stat`.
    subroutine flow_many(body, alike, h, n, m, stat, q)
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: n
        real(wp), intent(inout) :: m(:, :)
        integer, intent(out), optional :: stat
        real(wp), intent(inout), optional :: q(:, :)
        integer :: code

        code = status_bad_count
        if (size(m, 1) == 3 .and. .not. present(q)) then
            call flow_columns(body, alike, h, n, m(1, :), m(2, :), m(3, :), code)
        else if (present(q)) then
            if (size(m, 1) == 3 .and. size(q, 1) == 4) then
                call flow_columns(body, alike, h, n, m(1, :), m(2, :), m(3, :), code, q(1, :), q(2, :), &
                                  q(3, :), q(4, :))
            end if
        end if
        call return_or_stop(code, 'free_flow', stat)
    end subroutine flow_many

    !> Advances n bodies in blocks, one body per SIMD lane. The components of the states are vectors of any
    !> stride: rows or columns of arrays. The blocks are independent: with -fopenmp they are shared among the
    !> threads. What becomes of a body does not depend on the others: the same bits for any threads and parts
    !> of a batch. (So one body takes a block too, though a call for it alone is faster.) GCC reads the
    !> address of an optional argument that is `contiguous`, absent or not, where it is passed on.
    subroutine flow_columns(body, alike, h, n, m1, m2, m3, code, q0, q1, q2, q3)
        type(body_core), intent(in) :: body(:)      !! one for all or n
        logical, intent(in) :: alike                !! body(1) is meant for all, whatever n
        real(wp), intent(in) :: h(:)                !! one for all or n
        integer, intent(in) :: n
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        integer, intent(out) :: code                !! the largest of those of the bodies
        real(wp), intent(inout), optional :: q0(:), q1(:), q2(:), q3(:)     !! all or none
        type(block_of_bodies) :: block
        logical :: blocks_differ
        integer :: first, count, refused

        code = status_bad_count
        if (all(size(body) /= [1, n]) .or. all(size(h) /= [1, n])) return
        if (any([size(m1), size(m2), size(m3)] /= n)) return
        if (present(q0) .and. present(q1) .and. present(q2) .and. present(q3)) then
            if (any([size(q0), size(q1), size(q2), size(q3)] /= n)) return
        else if (present(q0) .or. present(q1) .or. present(q2) .or. present(q3)) then
            return
        end if
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
            call flow_block(body, h, first, count, block, m1, m2, m3, refused, q0, q1, q2, q3)
        end do
        !$omp end parallel do
        code = refused
    end subroutine flow_columns

    !> One block. Bodies that the lanes cannot move are moved by flow_body.
    subroutine flow_block(body, h, first, count, block, m1, m2, m3, refused, q0, q1, q2, q3)
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: first, count
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q0(:), q1(:), q2(:), q3(:)
        type(workspace) :: work
        real(wp) :: m(lanes, 3), total(lanes)
        logical :: all_moved
        integer :: l, high, step

        if (present(q0)) then
            call measure_attitudes(first, count, q0, q1, q2, q3, total)
        else
            total(:count) = 0.0_wp
        end if
        call load_momenta(first, count, whole(count), total, m1, m2, m3, m)
        if (.not. block%all_plain) call stop_lanes(whole(count), block%lane, m)
        call step_block(whole(count), present(q0), block, m(:, 1), m(:, 2), m(:, 3), work, all_moved)
        step = merge(count, 1, all_moved)
        do l = 1, count, step
            high = l + step - 1
            if (all_moved .or. work%size(l) <= period_limit) then
                associate (d => work%d, w => work%w, c => block%column)
                    call add(first, l, high, m, d(:, c(1)), d(:, c(2)), d(:, c(3)), m1, m2, m3)
                    if (.not. present(q0)) cycle
                    call turn_attitudes(first, l, high, work%w0, w(:, c(1)), w(:, c(2)), w(:, c(3)), &
                                        q0, q1, q2, q3)
                end associate
            else
                call flow_single(body, h, first + l - 1, m1, m2, m3, refused, q0, q1, q2, q3)
            end if
        end do
    end subroutine flow_block

    !> A quarter of the sums of sizes of components; `plain_largest` for NaN and for attitudes near zero.
    pure subroutine measure_attitudes(first, count, q0, q1, q2, q3, total)
        integer, intent(in) :: first, count
        real(wp), intent(in) :: q0(:), q1(:), q2(:), q3(:)
        real(wp), intent(out) :: total(lanes)
        real(wp) :: sizes
        integer :: l, k

        do l = 1, count
            k = first - 1 + l
            sizes = (0.25_wp*abs(q0(k)) + 0.25_wp*abs(q1(k))) + (0.25_wp*abs(q2(k)) + 0.25_wp*abs(q3(k)))
            sizes = merge(plain_largest, sizes, ieee_is_nan(sizes))     ! comparing a NaN would raise a flag
            total(l) = merge(plain_largest, 0.25_wp*sizes, sizes < plain_smallest)
        end do
    end subroutine measure_attitudes

    !> Momenta as columns; lanes up to a whole vector repeat the last one. Where the components of the state
    !> are not finite or near overflow, the momentum is 0: the lanes do not move it.
    pure subroutine load_momenta(first, count, full, total, m1, m2, m3, m)
        integer, intent(in) :: first, count, full
        real(wp), intent(in) :: total(lanes)        !! of the attitudes
        real(wp), intent(in) :: m1(:), m2(:), m3(:)
        real(wp), intent(out) :: m(lanes, 3)
        real(wp) :: x1, x2, x3, sizes
        integer :: l

        do l = 1, count
            x1 = m1(first - 1 + l)
            x2 = m2(first - 1 + l)
            x3 = m3(first - 1 + l)
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
    subroutine flow_single(body, h, k, m1, m2, m3, refused, q0, q1, q2, q3)
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: k
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q0(:), q1(:), q2(:), q3(:)
        real(wp) :: m(3), q(4)
        integer :: code

        associate (its_body => body(min(size(body), k)), time => h(min(size(h), k)))
            m = [m1(k), m2(k), m3(k)]
            if (present(q0)) then
                q = [q0(k), q1(k), q2(k), q3(k)]
                call flow_body(its_body, time, m, code, q)
                q0(k) = q(1)
                q1(k) = q(2)
                q2(k) = q(3)
                q3(k) = q(4)
            else
                call flow_body(its_body, time, m, code)
            end if
        end associate
        m1(k) = m(1)
        m2(k) = m(2)
        m3(k) = m(3)
        refused = max(refused, code)
    end subroutine flow_single

    !> The momenta m + d of lanes from `low` to `high`.
    pure subroutine add(first, low, high, m, d1, d2, d3, m1, m2, m3)
        integer, intent(in) :: first, low, high
        real(wp), intent(in) :: m(lanes, 3), d1(lanes), d2(lanes), d3(lanes)
        real(wp), intent(inout) :: m1(:), m2(:), m3(:)
        integer :: l

        !GCC$ ivdep
        do l = low, high
            m1(first - 1 + l) = m(l, 1) + d1(l)
            m2(first - 1 + l) = m(l, 2) + d2(l)
            m3(first - 1 + l) = m(l, 3) + d3(l)
        end do
    end subroutine add

    !> The attitudes q + q w of lanes from `low` to `high`.
    pure subroutine turn_attitudes(first, low, high, w0, w1, w2, w3, q0, q1, q2, q3)
        integer, intent(in) :: first, low, high
        real(wp), intent(in) :: w0(lanes), w1(lanes), w2(lanes), w3(lanes)
        real(wp), intent(inout) :: q0(:), q1(:), q2(:), q3(:)
        integer :: l, k

        !GCC$ ivdep
        do l = low, high
            k = first - 1 + l
            call turn(w0(l), w1(l), w2(l), w3(l), q0(k), q1(k), q2(k), q3(k))
        end do
    end subroutine turn_attitudes

    include 'turn_formulas.inc'

end module frb_flow_bodies
