!> Blocks of bodies for frb_flow_lanes: constants of equal or different bodies, and the way of vectors from
!> body axes to cyclic ones, the middle moment second, and back.
module frb_flow_blocks
    use frb_flow_lanes, only: lanes, vector, angle_as_reach, lane_bodies, workspace, step_cyclic
    use frb_flow_limits, only: plain_largest
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: block_of_bodies, set_bodies, step_lanes

    integer, parameter :: same_axes = 1, shifted_axes = 2, turned_axes = 3

    !> A block of bodies: its lanes from body axes to cyclic ones and back, and their constants.
    type :: block_of_bodies
        type(lane_bodies) :: of
        real(wp) :: lane(lanes)             !! see body_core; 0: the lane is not stepped here
        logical :: all_plain                !! all lanes are
        integer :: axes_are                 !! same_axes, shifted_axes, turned_axes
        integer :: column(3)                !! place of each body axis in the columns of the momenta
        real(wp) :: axes(lanes, 3, 3)       !! turned: (:, i, k), component along body axis i of cyclic axis k
    end type block_of_bodies

contains

    !> The constants of `count` bodies from the first, each with its time; lanes up to a whole vector repeat
    !> the last one. Lanes that are not plain, those of refused bodies among them, have constants 0.
    pure subroutine set_bodies(body, bodies, h, times, first, count, block)
        integer, intent(in) :: bodies, times, first, count
        type(body_core), intent(in) :: body(:)
        real(wp), intent(in) :: h(times)
        type(block_of_bodies), intent(inout) :: block
        real(wp) :: t(lanes), axis
        integer(int64) :: plain, turned, apart
        integer :: l, full

        full = min(lanes, vector*((count + vector - 1)/vector))
        call gather(body, bodies, first, count, full, block)
        if (times == 1) then
            t(:full) = merge(0.5_wp*h(1), 0.0_wp, abs(h(1)) < plain_largest)
        else
            t(:count) = merge(h(first:first + count - 1), 0.0_wp, ieee_is_finite(h(first:first + count - 1)))
            t(count + 1:full) = t(count)
            ! A time of 0 goes on as one that is too large does: by itself.
            t(:full) = merge(0.5_wp*t(:full), 0.0_wp, abs(t(:full)) < plain_largest)
        end if
        call scale_by_time(full, t, block%lane, block%of, plain)
        block%all_plain = plain == full
        turned = 0
        apart = 0
        do l = 1, full
            axis = abs(block%lane(l))
            turned = turned + merge(1_int64, 0_int64, axis > 3.5_wp)
            apart = apart + merge(1_int64, 0_int64, abs(axis - abs(block%lane(1))) > 0.5_wp)
        end do
        block%axes_are = merge(same_axes, merge(shifted_axes, turned_axes, turned == 0), apart + turned == 0)
        block%column = cshift([1, 2, 3], modulo(1 - int(abs(block%lane(1))), 3))
        if (block%axes_are /= same_axes) block%column = [1, 2, 3]
        if (block%axes_are /= turned_axes) return
        do l = 1, full
            associate (one => body(min(bodies, first + min(l, count) - 1)))
                if (one%parity > 0) then
                    block%axes(l, :, :) = one%axes(:, one%order)
                else
                    block%axes(l, :, :) = one%axes(:, one%order([3, 2, 1]))
                end if
            end associate
        end do
    end subroutine set_bodies

    !> Constants of bodies as columns.
    pure subroutine gather(body, bodies, first, count, full, block)
        integer, intent(in) :: bodies, first, count, full
        type(body_core), intent(in) :: body(:)
        type(block_of_bodies), intent(inout) :: block
        integer :: l, given, before

        given = merge(1, count, bodies == 1)
        before = merge(0, first - 1, bodies == 1)
        do l = 1, given
            associate (one => body(before + l))
                block%lane(l) = one%lane
                block%of%a(l) = one%alpha
                block%of%b(l) = one%beta
                block%of%g(l) = one%gamma
                block%of%first(l) = one%a(1)
                block%of%last(l) = one%a(3)
            end associate
        end do
        do l = given + 1, full
            block%lane(l) = block%lane(given)
            block%of%a(l) = block%of%a(given)
            block%of%b(l) = block%of%b(given)
            block%of%g(l) = block%of%g(given)
            block%of%first(l) = block%of%first(given)
            block%of%last(l) = block%of%last(given)
        end do
    end subroutine gather

    !> Times t, and with the axes in cyclic order, the middle moment second: of odd ones the first and the
    !> last change places. `plain` lanes turn by no angle near overflow; the others get 0.
    pure subroutine scale_by_time(n, t, lane, of, plain)
        integer, intent(in) :: n
        real(wp), intent(in) :: t(n)
        real(wp), intent(inout) :: lane(n)
        type(lane_bodies), intent(inout) :: of
        integer(int64), intent(out) :: plain
        real(wp) :: a, b, g, a1, a3, time, rate
        integer :: l

        plain = 0
        do l = 1, n
            a1 = merge(of%first(l), 0.0_wp, of%first(l) < plain_largest)
            rate = abs(a1*t(l))
            time = merge(t(l), 0.0_wp, rate < plain_largest)
            time = merge(time, 0.0_wp, rate > 0)
            time = merge(time, 0.0_wp, abs(lane(l)) > 0)
            plain = plain + merge(1_int64, 0_int64, abs(time) > 0)
            a1 = a1*time
            a3 = min(of%last(l), plain_largest)*time
            a = of%a(l)*time
            b = of%b(l)*time
            g = of%g(l)*time
            of%turn(l) = angle_as_reach*a1**2
            of%first(l) = merge(a3, a1, lane(l) < 0)
            of%last(l) = merge(a1, a3, lane(l) < 0)
            of%a(l) = merge(-g, a, lane(l) < 0)
            of%b(l) = merge(-b, b, lane(l) < 0)
            of%g(l) = merge(-a, g, lane(l) < 0)
            of%ag(l) = a*g
            of%ab(l) = of%a(l)*of%b(l)
            of%bg(l) = of%b(l)*of%g(l)
            lane(l) = merge(lane(l), 0.0_wp, abs(time) > 0)
        end do
    end subroutine scale_by_time

    !> Vectors of n lanes from body axes to cyclic ones.
    pure subroutine to_cyclic(n, block, x, v)
        integer, intent(in) :: n
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(in) :: x(lanes, 3)
        real(wp), intent(out) :: v(lanes, 3)
        real(wp) :: x1, x2, x3, axis
        integer :: l

        do l = 1, merge(n, 0, block%axes_are == shifted_axes)
            x1 = x(l, 1)
            x2 = x(l, 2)
            x3 = x(l, 3)
            axis = abs(block%lane(l))
            v(l, 1) = merge(x1, merge(x2, x3, axis < 2.5_wp), axis < 1.5_wp)
            v(l, 2) = merge(x2, merge(x3, x1, axis < 2.5_wp), axis < 1.5_wp)
            v(l, 3) = merge(x3, merge(x1, x2, axis < 2.5_wp), axis < 1.5_wp)
        end do
        do l = 1, merge(n, 0, block%axes_are == turned_axes)
            x1 = x(l, 1)
            x2 = x(l, 2)
            x3 = x(l, 3)
            v(l, 1) = block%axes(l, 1, 1)*x1 + (block%axes(l, 2, 1)*x2 + block%axes(l, 3, 1)*x3)
            v(l, 2) = block%axes(l, 1, 2)*x1 + (block%axes(l, 2, 2)*x2 + block%axes(l, 3, 2)*x3)
            v(l, 3) = block%axes(l, 1, 3)*x1 + (block%axes(l, 2, 3)*x2 + block%axes(l, 3, 3)*x3)
        end do
    end subroutine to_cyclic

    !> And back.
    pure subroutine from_cyclic(n, block, v)
        integer, intent(in) :: n
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(inout) :: v(lanes, 3)
        real(wp) :: v1, v2, v3, axis
        integer :: l

        do l = 1, merge(n, 0, block%axes_are == shifted_axes)
            v1 = v(l, 1)
            v2 = v(l, 2)
            v3 = v(l, 3)
            axis = abs(block%lane(l))
            v(l, 1) = merge(v1, merge(v3, v2, axis < 2.5_wp), axis < 1.5_wp)
            v(l, 2) = merge(v2, merge(v1, v3, axis < 2.5_wp), axis < 1.5_wp)
            v(l, 3) = merge(v3, merge(v2, v1, axis < 2.5_wp), axis < 1.5_wp)
        end do
        do l = 1, merge(n, 0, block%axes_are == turned_axes)
            v1 = v(l, 1)
            v2 = v(l, 2)
            v3 = v(l, 3)
            v(l, 1) = block%axes(l, 1, 1)*v1 + (block%axes(l, 1, 2)*v2 + block%axes(l, 1, 3)*v3)
            v(l, 2) = block%axes(l, 2, 1)*v1 + (block%axes(l, 2, 2)*v2 + block%axes(l, 2, 3)*v3)
            v(l, 3) = block%axes(l, 3, 1)*v1 + (block%axes(l, 3, 2)*v2 + block%axes(l, 3, 3)*v3)
        end do
    end subroutine from_cyclic

    !> The step of n lanes with momenta x, plain numbers, in columns as `block` has them: see step_cyclic.
    pure subroutine step_lanes(n, with_attitude, block, x, work, all_served)
        integer, intent(in) :: n
        logical, intent(in) :: with_attitude
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(in) :: x(lanes, 3)
        type(workspace), intent(inout) :: work
        logical, intent(out) :: all_served
        real(wp) :: cyclic(lanes, 3)

        if (block%axes_are /= same_axes) then
            call to_cyclic(n, block, x, cyclic)
            call step_cyclic(n, with_attitude, block%of, cyclic(:, 1), cyclic(:, 2), cyclic(:, 3), work, &
                             all_served)
            call from_cyclic(n, block, work%d)
            if (with_attitude) call from_cyclic(n, block, work%w)
        else
            call step_cyclic(n, with_attitude, block%of, x(:, 1), x(:, 2), x(:, 3), work, all_served)
        end if
    end subroutine step_lanes

end module frb_flow_blocks
