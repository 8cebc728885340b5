!> Many free bodies at once: blocks of them through SIMD lanes, blocks through threads.
module frb_flow_bodies
    use frb_flow_block, only: flow_block
    use frb_flow_lanes, only: lanes, block_of_bodies
    use frb_flow_limits, only: plain_largest, plain_smallest
    use frb_flow_one, only: flow_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: flow_many

contains

    !> Many bodies in blocks, one per SIMD lane; body(:) holds one body for all or one for each. The blocks
    !> are independent: with -fopenmp they are shared among the threads.
    subroutine flow_many(body, bodies, h, n, m, code, q)
        integer, intent(in) :: bodies, n            !! bodies: 1 or n
        type(body_core), intent(in) :: body(bodies)
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3, n)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4, n)
        type(block_of_bodies) :: block
        integer :: first, last, one, count, refused
        logical :: equal, served

        code = status_ok
        if (bodies == 1) code = body(1)%status
        if (code == status_ok .and. .not. ieee_is_finite(h)) code = status_bad_time
        if (code /= status_ok) return
        refused = status_ok
        equal = .false.
        if (bodies == 1) equal = .not. body(1)%needs_rotation .and. is_plain_time(body(1), h)
        if (equal) call set_body(body(1), block)
        !$omp parallel do if (n >= 64*lanes) firstprivate(block) private(last, one, count, served) &
        !$omp& reduction(max: refused)
        do first = 1, n, lanes
            last = min(first + lanes - 1, n)
            count = last - first + 1
            if (equal .and. count == lanes) then
                ! The usual case: whole blocks of one body; what is not plain goes the other way.
                if (present(q)) then
                    call flow_whole(body, h, block, m(1, first), served, refused, q(1, first))
                else
                    call flow_whole(body, h, block, m(1, first), served, refused)
                end if
                if (served) cycle
            end if
            one = merge(1, count, bodies == 1)
            associate (body_1 => body(merge(1, first, bodies == 1):merge(1, last, bodies == 1)))
                if (present(q)) then
                    call load_block(body_1, one, count, h, m(1, first), block, q(1, first))
                    call flow_block(block, 0.5_wp*h, .true., served)
                    call store_block(body_1, one, count, h, block, m(1, first), refused, q(1, first))
                else
                    call load_block(body_1, one, count, h, m(1, first), block)
                    call flow_block(block, 0.5_wp*h, .false., served)
                    call store_block(body_1, one, count, h, block, m(1, first), refused)
                end if
            end associate
            if (equal) call set_body(body(1), block)
        end do
        !$omp end parallel do
        code = refused
    end subroutine flow_many

    !> The same body into all lanes.
    pure subroutine set_body(body, bodies)
        type(body_core), intent(in) :: body
        type(block_of_bodies), intent(out) :: bodies

        bodies%alpha = body%alpha
        bodies%beta = body%beta
        bodies%gamma = body%gamma
        bodies%a1 = body%a(1)
        bodies%a3 = body%a(3)
        bodies%m = 0.0_wp
        bodies%q = 0.0_wp
        bodies%served = 0
    end subroutine set_body

    !> Advances `lanes` equal bodies if all are plain; else, served = .false., they are left as they are.
    subroutine flow_whole(body, h, bodies, m, served, refused, q)
        type(body_core), intent(in) :: body(1)             !! in its principal axes, plain in the time h
        real(wp), intent(in) :: h
        type(block_of_bodies), intent(inout) :: bodies      !! with the body in all lanes
        real(wp), intent(inout) :: m(3, lanes)
        logical, intent(out) :: served
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q(4, lanes)
        logical :: all_served
        integer :: l, i1, i2, i3

        ! Column of axis j in the block: the inverse of the sorting.
        i1 = findloc_of(int(body(1)%order), 1)
        i2 = findloc_of(int(body(1)%order), 2)
        i3 = findloc_of(int(body(1)%order), 3)
        do l = 1, lanes
            bodies%m(l, i1) = m(1, l)
            bodies%m(l, i2) = m(2, l)
            bodies%m(l, i3) = m(3, l)
        end do
        served = all_plain(bodies%m(:, 1), bodies%m(:, 2), bodies%m(:, 3))
        if (served .and. present(q)) then
            do l = 1, lanes
                bodies%q(l, 0) = q(1, l)
                bodies%q(l, i1) = q(2, l)
                bodies%q(l, i2) = q(3, l)
                bodies%q(l, i3) = q(4, l)
            end do
            served = all_plain(bodies%q(:, 0), bodies%q(:, 1), bodies%q(:, 2), bodies%q(:, 3))
        end if
        if (.not. served) return
        bodies%served = 1
        if (body(1)%parity < 0.0_wp) call reflect(bodies)
        call flow_block(bodies, 0.5_wp*h, present(q), all_served)
        if (.not. all_served) then
            call store_block(body, 1, lanes, h, bodies, m, refused, q)
            return
        end if
        if (body(1)%parity < 0.0_wp) call reflect(bodies)
        do l = 1, lanes
            m(1, l) = bodies%m(l, i1)
            m(2, l) = bodies%m(l, i2)
            m(3, l) = bodies%m(l, i3)
        end do
        if (.not. present(q)) return
        do l = 1, lanes
            q(1, l) = bodies%q(l, 0)
            q(2, l) = bodies%q(l, i1)
            q(3, l) = bodies%q(l, i2)
            q(4, l) = bodies%q(l, i3)
        end do
    end subroutine flow_whole

    !> To and from sorted axes that are right-handed: an odd sorting turns the last axis round.
    pure subroutine reflect(bodies)
        type(block_of_bodies), intent(inout) :: bodies

        bodies%m(:, 3) = -bodies%m(:, 3)
        bodies%q(:, 3) = -bodies%q(:, 3)
    end subroutine reflect

    !> Whether the largest component of every vector (x1, x2, x3, x4) is a plain number.
    pure function all_plain(x1, x2, x3, x4) result(plain)
        real(wp), intent(in) :: x1(lanes), x2(lanes), x3(lanes)
        real(wp), intent(in), optional :: x4(lanes)
        logical :: plain
        integer(int64) :: largest, smallest, most
        integer :: l

        largest = 0_int64
        smallest = huge(0_int64)
        do l = 1, lanes
            most = max(magnitude(x1(l)), magnitude(x2(l)), magnitude(x3(l)))
            if (present(x4)) most = max(most, magnitude(x4(l)))
            largest = max(largest, most)
            smallest = min(smallest, most)
        end do
        plain = are_plain(smallest, largest)
    end function all_plain

    !> Bodies first to last into the lanes of a block, in sorted axes; lanes that hold no plain state rest.
    subroutine load_block(body, different, count, h, m, bodies, q)
        integer, intent(in) :: different, count     !! bodies that differ: 1 or count
        type(body_core), intent(in) :: body(different)
        real(wp), intent(in) :: h
        real(wp), intent(in) :: m(3, count)
        type(block_of_bodies), intent(out) :: bodies
        real(wp), intent(in), optional :: q(4, count)
        integer :: l

        bodies%m = 0.0_wp
        bodies%q = 0.0_wp
        bodies%alpha = 0.0_wp
        bodies%beta = 0.0_wp
        bodies%gamma = 0.0_wp
        bodies%a1 = 0.0_wp
        bodies%a3 = 0.0_wp
        bodies%served = 0
        do l = 1, count
            associate (one => body(min(l, different)))
                bodies%m(l, :) = m(one%order, l)
                if (present(q)) bodies%q(l, :) = [q(1, l), q(1 + one%order, l)]
                if (lane_is_plain(one, h, bodies, l, present(q))) then
                    bodies%served(l) = 1
                    bodies%alpha(l) = one%alpha
                    bodies%beta(l) = one%beta
                    bodies%gamma(l) = one%gamma
                    bodies%a1(l) = one%a(1)
                    bodies%a3(l) = one%a(3)
                    bodies%m(l, 3) = one%parity*bodies%m(l, 3)
                    bodies%q(l, 3) = one%parity*bodies%q(l, 3)
                else
                    bodies%m(l, :) = 0.0_wp
                    bodies%q(l, :) = 0.0_wp
                end if
            end associate
        end do
    end subroutine load_block

    !> Whether angles that the body turns in the time h stay far from overflow.
    pure function is_plain_time(body, h) result(plain)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: h               !! finite
        logical :: plain

        plain = abs(h) < plain_largest .and. body%a(1) < plain_largest
        if (plain) plain = abs(body%a(1)*h) < plain_largest
    end function is_plain_time

    !> Whether one lane holds plain numbers of a body in its principal axes.
    pure function lane_is_plain(one, h, bodies, l, with_attitude) result(plain)
        type(body_core), intent(in) :: one
        real(wp), intent(in) :: h
        type(block_of_bodies), intent(in) :: bodies
        integer, intent(in) :: l
        logical, intent(in) :: with_attitude
        logical :: plain
        integer(int64) :: most

        plain = one%status == status_ok .and. .not. one%needs_rotation
        if (.not. plain) return
        most = maxval(magnitude(bodies%m(l, :)))
        plain = are_plain(most, most) .and. is_plain_time(one, h)
        if (plain .and. with_attitude) then
            most = maxval(magnitude(bodies%q(l, :)))
            plain = are_plain(most, most)
        end if
    end function lane_is_plain

    !> Lanes back to bodies first to last; those the block did not serve go one by one.
    subroutine store_block(body, different, count, h, bodies, m, refused, q)
        integer, intent(in) :: different, count     !! bodies that differ: 1 or count
        type(body_core), intent(in) :: body(different)
        real(wp), intent(in) :: h
        type(block_of_bodies), intent(in) :: bodies
        real(wp), intent(inout) :: m(3, count)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q(4, count)
        integer :: l, code

        do l = 1, count
            associate (one => body(min(l, different)))
                if (bodies%served(l) == 1) then
                    m(one%order, l) = [bodies%m(l, 1), bodies%m(l, 2), one%parity*bodies%m(l, 3)]
                    if (present(q)) then
                        q(1, l) = bodies%q(l, 0)
                        q(1 + one%order, l) = [bodies%q(l, 1), bodies%q(l, 2), one%parity*bodies%q(l, 3)]
                    end if
                else if (present(q)) then
                    call flow_body(one, h, m(:, l), code, q(:, l))
                    refused = max(refused, code)
                else
                    call flow_body(one, h, m(:, l), code)
                    refused = max(refused, code)
                end if
            end associate
        end do
    end subroutine store_block

    !> Place of a value among three (findloc is not in Fortran 2008).
    pure function findloc_of(values, value) result(place)
        integer, intent(in) :: values(3), value
        integer :: place

        place = 1
        if (values(2) == value) place = 2
        if (values(3) == value) place = 3
    end function findloc_of

    include 'plain_numbers.inc'

end module frb_flow_bodies
