!> Blocks of bodies for frb_flow_lanes: constants of equal or different bodies, and vectors in body axes taken
!> to cyclic axes, the middle moment second, and back.
module frb_flow_blocks
    use frb_flow_lanes, only: lanes, vector, classes, limits, lane_bodies, workspace, measure, step_lanes
    use frb_flow_lanes_long, only: step_long
    use frb_flow_limits, only: plain_largest
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: block_of_bodies, set_bodies, step_block, find_classes, whole, polynomial_of_rho

    integer, parameter :: same_axes = 1, shifted_axes = 2, turned_axes = 3

    !> A block of bodies: the relation of body axes to cyclic axes in each lane, and the constants.
    type :: block_of_bodies
        type(lane_bodies) :: of
        real(wp) :: lane(lanes)             !! see body_core; 0: the lane does not move here
        logical :: all_plain                !! all lanes have plain numbers
        integer :: axes_are                 !! same_axes, shifted_axes, turned_axes
        integer :: column(3)                !! place of each body axis in the columns of increments
        real(wp) :: high(lanes, 3, 3)       !! turned: (:, i, k), along body axis i of cyclic axis k,
        real(wp) :: low(lanes, 3, 3)        !! in two parts: see to_principal of frb_inertia
    end type block_of_bodies

contains

    !> `count` lanes rounded up to whole vectors: no loop ends with a part of a vector.
    pure function whole(count) result(full)
        integer, intent(in) :: count
        integer :: full

        full = vector*((count + vector - 1)/vector)
    end function whole

    !> The constants of `count` bodies, each with its time; lanes up to a whole vector repeat the last one.
    !> Lanes that are not plain, those of refused bodies among them, have constants 0.
    pure subroutine set_bodies(body, alike, h, number, count, block)
        type(body_core), intent(in) :: body(:)
        logical, intent(in) :: alike
        real(wp), intent(in) :: h(:)
        integer, intent(in) :: count, number(lanes)     !! which of the bodies, and of the times
        type(block_of_bodies), intent(inout) :: block
        real(wp) :: t(lanes), axis, axis_of_first
        integer(int64) :: plain_lanes, turned, apart
        integer :: l, full, cyclic(3)

        full = whole(count)
        call gather(body, number, count, full, block%lane, block%of)
        turned = 0
        apart = 0
        axis_of_first = abs(block%lane(1))
        do l = 1, full
            axis = abs(block%lane(l))
            turned = turned + merge(1_int64, 0_int64, axis > 3.5_wp)
            apart = apart + merge(1_int64, 0_int64, abs(axis - axis_of_first) > 0.5_wp)
        end do
        if (size(h) == 1) then
            t(:full) = merge(0.5_wp*h(1), 0.0_wp, abs(h(1)) < plain_largest)
        else
            do l = 1, full
                t(l) = h(number(min(l, count)))
            end do
            t(:full) = merge(t(:full), 0.0_wp, ieee_is_finite(t(:full)))
            ! A time of 0 goes on as one that is too large does: by itself.
            t(:full) = merge(0.5_wp*t(:full), 0.0_wp, abs(t(:full)) < plain_largest)
        end if
        block%axes_are = merge(same_axes, merge(shifted_axes, turned_axes, turned == 0), apart + turned == 0)
        block%column = [1, 2, 3]
        if (block%axes_are == same_axes) block%column = 1 + modulo([4, 5, 6] - int(axis_of_first), 3)
        call scale_by_time(full, t, block%lane, block%of, plain_lanes)
        block%all_plain = plain_lanes == full
        block%of%alike = alike
        block%of%inverse = body(1)%a
        block%of%odd = body(1)%lane < 0
        block%of%full = full
        block%of%rho_known = .false.
        if (block%axes_are /= turned_axes) return
        do l = 1, full
            associate (given => body(min(size(body), number(min(l, count)))))
                cyclic = given%order
                if (given%parity < 0) cyclic = given%order([3, 2, 1])
                block%high(l, :, :) = given%axes_high(:, cyclic)
                block%low(l, :, :) = given%axes_low(:, cyclic)
            end associate
        end do
    end subroutine set_bodies

    !> Constants as columns, of the only body or of `count` bodies of these ascending numbers.
    pure subroutine gather(body, number, count, full, lane, of)
        type(body_core), intent(in) :: body(:)
        integer, intent(in) :: number(lanes), count, full
        real(wp), intent(inout) :: lane(lanes)
        type(lane_bodies), intent(inout) :: of
        integer :: l, known, before

        known = merge(count, 0, size(body) > 1)
        before = number(1) - 1
        if (number(count) - before == count) then
            do l = 1, known
                call put_constants(body(before + l), l, lane, of)
            end do
        else
            do l = 1, known
                call put_constants(body(number(l)), l, lane, of)
            end do
        end if
        do l = known + 1, full
            call put_constants(body(min(size(body), number(count))), l, lane, of)
        end do
    end subroutine gather

    !> Constants of a body as those of lane l.
    pure subroutine put_constants(body, l, lane, of)
        type(body_core), intent(in) :: body
        integer, intent(in) :: l
        real(wp), intent(inout) :: lane(lanes)
        type(lane_bodies), intent(inout) :: of

        lane(l) = body%lane
        of%a(l) = body%alpha
        of%b(l) = body%beta
        of%g(l) = body%gamma
        of%first(l) = body%a(1)
        of%last(l) = body%a(3)
    end subroutine put_constants

    !> The constant rho of frb_flow_lanes as a polynomial in u and e to degree 4: coefficients of u to u^4, of
    !> e to e u^3, of e^2 to e^2 u^2, of e^3, e^3 u and of e^4.
    pure function polynomial_of_rho(a) result(rho)
        real(wp), intent(in) :: a(3)        !! in descending order
        real(wp) :: rho(14)
        real(wp) :: a2, a3, s1, s2, s3, s11, s22, s33, s12, s23, s13

        a2 = a(2)/a(1)
        a3 = a(3)/a(1)
        s1 = 1 + a2 + a3
        s2 = a2 + a3 + a2*a3
        s3 = a2*a3
        s11 = s1*s1
        s22 = s2*s2
        s33 = s3*s3
        s12 = s1*s2
        s23 = s2*s3
        s13 = s1*s3
        rho(1) = -s3*(2/3.0_wp)
        rho(2) = s23*(7/45.0_wp)
        rho(3) = -(s13*s3*(4/105.0_wp) + s22*s3*(22/945.0_wp))
        rho(4) = s12*s33*(11/525.0_wp) + s22*s23*(1/675.0_wp) - s33*s3*(2/567.0_wp)
        rho(5) = s2*(1/3.0_wp)
        rho(6) = s13*(4/45.0_wp) - s22*(8/45.0_wp)
        rho(7) = s12*s3*(106/945.0_wp) + s2*s22*(4/189.0_wp) - s33*(64/315.0_wp)
        rho(8) = s2*s33*(268/4725.0_wp) - s13*s13*(8/525.0_wp) - s12*s23*(68/1575.0_wp) &
                       - s22*s22*(8/4725.0_wp)
        rho(9) = s12*(7/45.0_wp) - s3*(2/5.0_wp)
        rho(10) = s23*(82/315.0_wp) - s11*s3*(52/945.0_wp) - s12*s2*(16/189.0_wp)
        rho(11) = s12*s13*(94/1575.0_wp) + s12*s22*(8/315.0_wp) - s13*s3*(4/105.0_wp) &
                        - s22*s3*(431/4725.0_wp)
        rho(12) = s11*s2*(62/945.0_wp) - s13*(8/105.0_wp) - s22*(19/315.0_wp)
        rho(13) = s12*s3*(8/75.0_wp) + s2*s22*(472/14175.0_wp) - s11*s13*(8/675.0_wp) &
                        - s12*s12*(16/315.0_wp) - s33*(16/175.0_wp)
        rho(14) = s11*s12*(127/4725.0_wp) - s11*s3*(22/525.0_wp) - s12*s2*(19/525.0_wp) &
                        + s23*(31/525.0_wp)
    end function polynomial_of_rho

    !> What the shortest steps of equal bodies need.
    pure subroutine set_rho(of)
        type(lane_bodies), intent(inout) :: of
        integer :: l

        of%rho = polynomial_of_rho(of%inverse)
        do l = 1, of%full
            of%base(l) = merge(of%first(l), of%last(l), of%odd)
            of%above(l, 1) = merge(0.0_wp, of%b(l), of%odd)
            of%above(l, 2) = merge(-of%g(l), of%a(l), of%odd)
            of%above(l, 3) = merge(-of%b(l), 0.0_wp, of%odd)
        end do
        of%rho_known = .true.
    end subroutine set_rho

    !> Times t, and with the axes in cyclic order, the middle moment second: of odd ones the first and the
    !> last change places. `plain_lanes` turn by no angle near overflow; the others get 0.
    pure subroutine scale_by_time(n, t, lane, of, plain_lanes)
        integer, intent(in) :: n
        real(wp), intent(in) :: t(n)
        real(wp), intent(inout) :: lane(n)
        type(lane_bodies), intent(inout) :: of
        integer(int64), intent(out) :: plain_lanes
        real(wp) :: a, b, g, a1, a3, time, rate
        logical :: odd
        integer :: l

        plain_lanes = 0
        do l = 1, n
            a1 = merge(of%first(l), 0.0_wp, of%first(l) < plain_largest)
            rate = abs(a1*t(l))
            time = merge(t(l), 0.0_wp, rate < plain_largest)
            time = merge(time, 0.0_wp, rate > 0)
            time = merge(time, 0.0_wp, abs(lane(l)) > 0)
            plain_lanes = plain_lanes + merge(1_int64, 0_int64, abs(time) > 0)
            a1 = a1*time
            a3 = min(of%last(l), plain_largest)*time
            a = of%a(l)*time
            b = of%b(l)*time
            g = of%g(l)*time
            odd = lane(l) < 0
            of%rate(l) = a1
            of%first(l) = merge(a3, a1, odd)
            of%last(l) = merge(a1, a3, odd)
            of%a(l) = merge(-g, a, odd)
            of%b(l) = merge(-b, b, odd)
            of%g(l) = merge(-a, g, odd)
            of%ag(l) = a*g
            of%ab(l) = of%a(l)*of%b(l)
            of%bg(l) = of%b(l)*of%g(l)
            lane(l) = merge(lane(l), 0.0_wp, abs(time) > 0)
        end do
    end subroutine scale_by_time

    !> Vectors of n lanes from body axes to cyclic ones.
    pure subroutine to_cyclic(n, block, u1, u2, u3, v)
        integer, intent(in) :: n
        type(block_of_bodies), intent(in) :: block
        real(wp), intent(in) :: u1(n), u2(n), u3(n)
        real(wp), intent(out) :: v(lanes, 3)
        real(wp) :: x1, x2, x3, axis
        integer :: l

        do l = 1, merge(n, 0, block%axes_are == shifted_axes)
            x1 = u1(l)
            x2 = u2(l)
            x3 = u3(l)
            axis = abs(block%lane(l))
            v(l, 1) = merge(x1, merge(x2, x3, axis < 2.5_wp), axis < 1.5_wp)
            v(l, 2) = merge(x2, merge(x3, x1, axis < 2.5_wp), axis < 1.5_wp)
            v(l, 3) = merge(x3, merge(x1, x2, axis < 2.5_wp), axis < 1.5_wp)
        end do
        do l = 1, merge(n, 0, block%axes_are == turned_axes)
            x1 = u1(l)
            x2 = u2(l)
            x3 = u3(l)
            v(l, 1) = (block%high(l, 1, 1)*x1 + block%high(l, 2, 1)*x2 + block%high(l, 3, 1)*x3) &
                      + (block%low(l, 1, 1)*x1 + block%low(l, 2, 1)*x2 + block%low(l, 3, 1)*x3)
            v(l, 2) = (block%high(l, 1, 2)*x1 + block%high(l, 2, 2)*x2 + block%high(l, 3, 2)*x3) &
                      + (block%low(l, 1, 2)*x1 + block%low(l, 2, 2)*x2 + block%low(l, 3, 2)*x3)
            v(l, 3) = (block%high(l, 1, 3)*x1 + block%high(l, 2, 3)*x2 + block%high(l, 3, 3)*x3) &
                      + (block%low(l, 1, 3)*x1 + block%low(l, 2, 3)*x2 + block%low(l, 3, 3)*x3)
        end do
    end subroutine to_cyclic

    !> Vectors of n lanes from cyclic axes to body axes.
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
            v(l, 1) = (block%high(l, 1, 1)*v1 + block%high(l, 1, 2)*v2 + block%high(l, 1, 3)*v3) &
                      + (block%low(l, 1, 1)*v1 + block%low(l, 1, 2)*v2 + block%low(l, 1, 3)*v3)
            v(l, 2) = (block%high(l, 2, 1)*v1 + block%high(l, 2, 2)*v2 + block%high(l, 2, 3)*v3) &
                      + (block%low(l, 2, 1)*v1 + block%low(l, 2, 2)*v2 + block%low(l, 2, 3)*v3)
            v(l, 3) = (block%high(l, 3, 1)*v1 + block%high(l, 3, 2)*v2 + block%high(l, 3, 3)*v3) &
                      + (block%low(l, 3, 1)*v1 + block%low(l, 3, 2)*v2 + block%low(l, 3, 3)*v3)
        end do
    end subroutine from_cyclic

    !> The step of n lanes with momenta (x1, x2, x3) in body axes, plain numbers: increments and,
    !> with_attitude, turns in columns as `block` has them. Lanes of several classes: those of the class that
    !> most have; the others stand still.
    pure subroutine step_block(n, with_attitude, block, x1, x2, x3, work, class, moved)
        integer, intent(in) :: n
        logical, intent(in) :: with_attitude
        type(block_of_bodies), intent(inout) :: block
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        integer, intent(out) :: class       !! that moves; 0: none has half of the lanes, or a lane has none
        integer, intent(out) :: moved       !! number of lanes of this class
        real(wp) :: cyclic(lanes, 3)

        if (block%axes_are /= same_axes) then
            call to_cyclic(n, block, x1, x2, x3, cyclic)
            call step_cyclic(n, with_attitude, block%of, cyclic(:, 1), cyclic(:, 2), cyclic(:, 3), work, &
                             class, moved)
            if (class == 0) return
            call from_cyclic(n, block, work%d)
            if (with_attitude) call from_cyclic(n, block, work%w)
        else if (block%column(1) == 1) then
            call step_cyclic(n, with_attitude, block%of, x1, x2, x3, work, class, moved)
        else if (block%column(1) == 2) then
            call step_cyclic(n, with_attitude, block%of, x3, x1, x2, work, class, moved)
        else
            call step_cyclic(n, with_attitude, block%of, x2, x3, x1, work, class, moved)
        end if
    end subroutine step_block

    !> The same in cyclic axes.
    pure subroutine step_cyclic(n, with_attitude, of, x1, x2, x3, work, class, moved)
        integer, intent(in) :: n
        logical, intent(in) :: with_attitude
        type(lane_bodies), intent(inout) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        integer, intent(out) :: class, moved
        real(wp) :: m1(lanes), m2(lanes), m3(lanes), factor
        integer :: many(0:classes), l

        call measure(n, of, x1, x2, x3, work, many)
        class = maxloc(many(1:) - many(:classes - 1), 1)
        moved = many(class) - many(class - 1)
        if (moved == n) then
            call step_class(class, n, with_attitude, of, x1, x2, x3, work)
        else if (2*moved < n .or. many(classes) < n) then
            class = 0
        else
            do l = 1, n
                factor = merge(1.0_wp, 0.0_wp, work%size(l) <= limits(class))
                if (many(class - 1) > 0) factor = merge(0.0_wp, factor, work%size(l) <= limits(class - 1))
                m1(l) = factor*x1(l)
                m2(l) = factor*x2(l)
                m3(l) = factor*x3(l)
                work%p(l) = factor*work%p(l)
                work%r(l) = factor*work%r(l)
            end do
            call step_class(class, n, with_attitude, of, m1(:n), m2(:n), m3(:n), work)
        end if
    end subroutine step_cyclic

    !> The classes of steps of these sizes; `classes` + 1 where the lanes do not serve them.
    pure subroutine find_classes(n, alike, sizes, found)
        integer, intent(in) :: n
        logical, intent(in) :: alike            !! see measure
        real(wp), intent(in) :: sizes(lanes)
        integer, intent(out) :: found(lanes)
        integer :: l, i

        found(:n) = merge(1, 2, alike)
        do i = merge(1, 2, alike), classes
            do l = 1, n
                found(l) = found(l) + merge(1, 0, sizes(l) > limits(i))
            end do
        end do
    end subroutine find_classes

    !> The step of lanes of one class.
    pure subroutine step_class(class, n, with_attitude, of, x1, x2, x3, work)
        integer, intent(in) :: class, n
        logical, intent(in) :: with_attitude
        type(lane_bodies), intent(inout) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work

        if (class == 1 .and. with_attitude .and. .not. of%rho_known) call set_rho(of)
        if (class == classes) then
            call step_long(n, with_attitude, of, x1, x2, x3, work)
        else
            call step_lanes(class, n, with_attitude, of, x1, x2, x3, work)
        end if
    end subroutine step_class

end module frb_flow_blocks
