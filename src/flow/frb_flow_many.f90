!> Many free bodies at once: blocks of them through SIMD lanes, blocks through threads.
module frb_flow_many
    use frb_flow_block, only: lanes, block_of_bodies, flow_block
    use frb_flow_limits, only: plain_largest, plain_smallest
    use frb_flow_one, only: flow_body
    use frb_inertia, only: rigid_body
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: flow_many

contains

    !> Many bodies in blocks, one per SIMD lane; body(:) holds one body for all or one for each. The blocks
    !> are independent: with -fopenmp they are shared among the threads.
    subroutine flow_many(body, bodies, h, n, m, code, q)
        integer, intent(in) :: bodies, n            !! bodies: 1 or n
        type(rigid_body), intent(in) :: body(bodies)
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3, n)
        integer, intent(out) :: code
        real(wp), intent(inout), optional :: q(4, n)
        type(block_of_bodies) :: block
        integer :: first, last, one, count, refused

        code = status_ok
        if (bodies == 1) code = body(1)%status
        if (code == status_ok .and. .not. ieee_is_finite(h)) code = status_bad_time
        if (code /= status_ok) return
        refused = status_ok
        !$omp parallel do if (n >= 64*lanes) private(block, last, one, count) reduction(max: refused)
        do first = 1, n, lanes
            last = min(first + lanes - 1, n)
            count = last - first + 1
            one = merge(1, count, bodies == 1)
            associate (body_1 => body(merge(1, first, bodies == 1):merge(1, last, bodies == 1)))
                if (present(q)) then
                    call load_block(body_1, one, count, h, m(1, first), block, q(1, first))
                    call flow_block(block, 0.5_wp*h, .true.)
                    call store_block(body_1, one, count, h, block, m(1, first), refused, q(1, first))
                else
                    call load_block(body_1, one, count, h, m(1, first), block)
                    call flow_block(block, 0.5_wp*h, .false.)
                    call store_block(body_1, one, count, h, block, m(1, first), refused)
                end if
            end associate
        end do
        !$omp end parallel do
        code = refused
    end subroutine flow_many

    !> Bodies first to last into the lanes of a block, in sorted axes; lanes that hold no plain state rest.
    subroutine load_block(body, different, count, h, m, bodies, q)
        integer, intent(in) :: different, count     !! bodies that differ: 1 or count
        type(rigid_body), intent(in) :: body(different)
        real(wp), intent(in) :: h
        real(wp), intent(in) :: m(3, count)
        type(block_of_bodies), intent(out) :: bodies
        real(wp), intent(in), optional :: q(4, count)
        real(wp) :: parity
        integer :: l, i1, i2, i3

        if (count < lanes) then
            bodies%m = 0.0_wp
            bodies%q = 0.0_wp
        end if
        bodies%served = 0
        if (different == 1) then
            bodies%alpha = body(1)%alpha
            bodies%beta = body(1)%beta
            bodies%gamma = body(1)%gamma
            bodies%a1 = body(1)%a(1)
            bodies%a3 = body(1)%a(3)
            ! Column of axis j in the block: the inverse of the sorting.
            i1 = findloc_of(body(1)%order, 1)
            i2 = findloc_of(body(1)%order, 2)
            i3 = findloc_of(body(1)%order, 3)
            parity = body(1)%parity
            do l = 1, count
                bodies%m(l, i1) = parity*m(1, l)
                bodies%m(l, i2) = parity*m(2, l)
                bodies%m(l, i3) = parity*m(3, l)
            end do
            if (present(q)) then
                do l = 1, count
                    bodies%q(l, 0) = q(1, l)
                    bodies%q(l, i1) = parity*q(2, l)
                    bodies%q(l, i2) = parity*q(3, l)
                    bodies%q(l, i3) = parity*q(4, l)
                end do
            end if
        else
            bodies%alpha = 0.0_wp
            bodies%beta = 0.0_wp
            bodies%gamma = 0.0_wp
            bodies%a1 = 0.0_wp
            bodies%a3 = 0.0_wp
            do l = 1, count
                bodies%alpha(l) = body(l)%alpha
                bodies%beta(l) = body(l)%beta
                bodies%gamma(l) = body(l)%gamma
                bodies%a1(l) = body(l)%a(1)
                bodies%a3(l) = body(l)%a(3)
                bodies%m(l, :) = body(l)%parity*m(body(l)%order, l)
                if (present(q)) then
                    bodies%q(l, 0) = q(1, l)
                    bodies%q(l, 1:3) = body(l)%parity*q(1 + body(l)%order, l)
                end if
            end do
        end if
        if (different == 1 .and. count == lanes) then
            if (all_plain(body(1), h, bodies, present(q))) then
                bodies%served = 1
                return
            end if
        end if
        do l = 1, count
            if (lane_is_plain(body(min(l, different)), h, bodies, l, present(q))) then
                bodies%served(l) = 1
            else
                bodies%m(l, :) = 0.0_wp
                bodies%q(l, :) = 0.0_wp
                bodies%alpha(l) = 0.0_wp
                bodies%beta(l) = 0.0_wp
                bodies%gamma(l) = 0.0_wp
                bodies%a1(l) = 0.0_wp
                bodies%a3(l) = 0.0_wp
            end if
        end do
    end subroutine load_block

    !> Whether all lanes of equal bodies hold plain numbers: a test without branches for the usual case.
    pure function all_plain(body, h, bodies, with_attitude) result(plain)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        type(block_of_bodies), intent(in) :: bodies
        logical, intent(in) :: with_attitude
        logical :: plain
        integer, parameter :: width = 8
        real(wp) :: size_m(lanes), size_q(lanes), total(width)
        integer :: l, outside

        plain = .false.
        if (body%turned) return
        if (.not. is_plain_time(body, h)) return
        size_m = 0.01_wp*abs(bodies%m(:, 1)) + 0.01_wp*abs(bodies%m(:, 2)) + 0.01_wp*abs(bodies%m(:, 3))
        size_q = 1.0_wp
        if (with_attitude) size_q = 0.01_wp*abs(bodies%q(:, 0)) + 0.01_wp*abs(bodies%q(:, 1)) &
            + 0.01_wp*abs(bodies%q(:, 2)) + 0.01_wp*abs(bodies%q(:, 3))
        ! A NaN or Inf anywhere shows in the sum; numbers are compared only when there is none.
        total = 0.0_wp
        do l = 1, lanes, width
            total = total + size_m(l:l + width - 1) + size_q(l:l + width - 1)
        end do
        plain = all(ieee_is_finite(total))
        if (.not. plain) return
        outside = 0
        do l = 1, lanes
            outside = outside + merge(1, 0, size_m(l) >= plain_largest .or. size_m(l) <= plain_smallest &
                                      .or. size_q(l) >= plain_largest .or. size_q(l) <= plain_smallest)
        end do
        plain = outside == 0
    end function all_plain

    !> Whether angles that the body turns in the time h stay far from overflow.
    pure function is_plain_time(body, h) result(plain)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h               !! finite
        logical :: plain

        plain = abs(h) < plain_largest .and. body%a(1) < plain_largest
        if (plain) plain = abs(body%a(1)*h) < plain_largest
    end function is_plain_time

    !> Whether one lane holds plain numbers of a body in its principal axes.
    pure function lane_is_plain(one, h, bodies, l, with_attitude) result(plain)
        type(rigid_body), intent(in) :: one
        real(wp), intent(in) :: h
        type(block_of_bodies), intent(in) :: bodies
        integer, intent(in) :: l
        logical, intent(in) :: with_attitude
        logical :: plain
        real(wp) :: size_m, size_q

        plain = one%status == status_ok .and. .not. one%turned
        if (.not. plain) return
        size_m = sum(0.01_wp*abs(bodies%m(l, :)))
        plain = ieee_is_finite(size_m)
        if (plain) plain = size_m < plain_largest .and. size_m > plain_smallest
        if (plain) plain = is_plain_time(one, h)
        if (plain .and. with_attitude) then
            size_q = sum(0.01_wp*abs(bodies%q(l, :)))
            plain = ieee_is_finite(size_q)
            if (plain) plain = size_q < plain_largest .and. size_q > plain_smallest
        end if
    end function lane_is_plain

    !> Lanes back to bodies first to last; those the block did not serve go one by one.
    subroutine store_block(body, different, count, h, bodies, m, refused, q)
        integer, intent(in) :: different, count     !! bodies that differ: 1 or count
        type(rigid_body), intent(in) :: body(different)
        real(wp), intent(in) :: h
        type(block_of_bodies), intent(in) :: bodies
        real(wp), intent(inout) :: m(3, count)
        integer, intent(inout) :: refused
        real(wp), intent(inout), optional :: q(4, count)
        real(wp) :: parity
        integer :: l, i1, i2, i3, code

        if (different == 1 .and. all(bodies%served(1:count) == 1)) then
            i1 = findloc_of(body(1)%order, 1)
            i2 = findloc_of(body(1)%order, 2)
            i3 = findloc_of(body(1)%order, 3)
            parity = body(1)%parity
            do l = 1, count
                m(1, l) = parity*bodies%m(l, i1)
                m(2, l) = parity*bodies%m(l, i2)
                m(3, l) = parity*bodies%m(l, i3)
            end do
            if (present(q)) then
                do l = 1, count
                    q(1, l) = bodies%q(l, 0)
                    q(2, l) = parity*bodies%q(l, i1)
                    q(3, l) = parity*bodies%q(l, i2)
                    q(4, l) = parity*bodies%q(l, i3)
                end do
            end if
            return
        end if
        do l = 1, count
            associate (one => body(min(l, different)))
                if (bodies%served(l) == 1) then
                    m(one%order, l) = one%parity*bodies%m(l, :)
                    if (present(q)) then
                        q(1, l) = bodies%q(l, 0)
                        q(1 + one%order, l) = one%parity*bodies%q(l, 1:3)
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

end module frb_flow_many
