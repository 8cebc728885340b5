!> The lanes of a block whose step is too long for frb_flow_lanes: the formulas of frb_flow_long in lanes, by
!> doubling the triple, up to about ten periods. One body after another would take 2 to 3 times longer.
module frb_flow_lanes_long
    use frb_flow_lanes, only: lanes, lane_bodies, workspace
    use frb_flow_limits, only: middle_limit, square_limit, smallest_denominator
    use frb_kinds, only: wp
    implicit none
    private

    public :: step_long

    !> The triple at a part of the time and its numbers of doublings; (ec, es) the angle of the third kind.
    type :: long_lanes
        real(wp) :: m1(lanes), m2(lanes), m3(lanes), gg(lanes)
        real(wp) :: p(lanes), r(lanes), delta(lanes), part(lanes)   !! delta = (R - P) t^2
        real(wp) :: squares(lanes), triples(lanes)                  !! doublings of s^2 and then of the triple
        real(wp) :: y(lanes), s(lanes), c(lanes), d(lanes), z(lanes)
        real(wp) :: old_y(lanes), old_z(lanes)
        real(wp) :: form(lanes), nu(lanes), bg(lanes), ec(lanes), es(lanes)
        real(wp) :: n0(lanes), n1(lanes), n2(lanes), n3(lanes)
    end type long_lanes

contains

    !> As step_lanes of frb_flow_lanes, for longer steps.
    pure subroutine step_long(n, with_attitude, of, x1, x2, x3, work)
        integer, intent(in) :: n
        logical, intent(in) :: with_attitude
        type(lane_bodies), intent(in) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        type(long_lanes) :: at
        integer :: i, most

        at%m1(:n) = x1
        at%m2(:n) = x2
        at%m3(:n) = x3
        at%p(:n) = work%p(:n)
        at%r(:n) = work%r(:n)
        at%part(:n) = 1.0_wp
        call count_halvings(n, square_limit, at%p, at%r, at%part, at%triples)
        call count_halvings(n, middle_limit, at%p, at%r, at%part, at%squares)       ! nu <= max(p, r)
        call begin(n, of, at)
        if (with_attitude) call begin_angles(n, of, at)
        most = nint(maxval(at%squares(:n)))
        do i = 1, most
            call double_squares(n, real(i, wp), at)
            if (with_attitude) call double_angles(n, real(i, wp), at%squares, at)
        end do
        most = nint(maxval(at%triples(:n)))
        do i = 1, most
            call double_triples(n, real(i, wp), at)
            if (with_attitude) call double_angles(n, real(i, wp), at%triples, at)
            if (any(at%z(:n) < smallest_denominator)) call form_anew(n, with_attitude, at)
        end do
        call move(n, of, at, work)
        if (with_attitude) call turn_lanes(n, of, at, work)
    end subroutine step_long

    !> The number of halvings of the time that bring max(p, r) part^2 down to `limit` in each lane.
    pure subroutine count_halvings(n, limit, p, r, part, halvings)
        integer, intent(in) :: n
        real(wp), intent(in) :: limit, p(lanes), r(lanes)
        real(wp), intent(inout) :: part(lanes)
        real(wp), intent(out) :: halvings(lanes)
        integer, parameter :: most = 2*maxexponent(1.0_wp)      ! of a finite number
        real(wp) :: over
        integer :: i, l

        halvings(:n) = 0.0_wp
        do i = 1, most
            do l = 1, n
                over = merge(1.0_wp, 0.0_wp, max(p(l), r(l))*(part(l)*part(l)) > limit)
                halvings(l) = halvings(l) + over
                part(l) = part(l)*(1 - 0.5_wp*over)
            end do
            if (all(max(p(:n), r(:n))*part(:n)**2 <= limit)) return
        end do
    end subroutine count_halvings

    !> The triple where the doublings begin.
    pure subroutine begin(n, of, at)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        type(long_lanes), intent(inout) :: at
        real(wp) :: span, y, scd
        integer :: l

        do l = 1, n
            at%gg(l) = at%m1(l)*at%m1(l) + (at%m2(l)*at%m2(l) + at%m3(l)*at%m3(l))
            at%delta(l) = orbit_difference(of%a(l), of%b(l), of%g(l), at%m1(l), at%m3(l))
        end do
        do l = 1, n
            span = at%part(l)*at%part(l)
            call middle_series((at%p(l) + at%r(l))*span, at%p(l)*at%r(l)*(span*span), y, scd)
            y = y*span
            at%y(l) = y
            at%s(l) = sqrt(y)
            at%c(l) = sqrt(1 - max(at%p(l), at%r(l))*y)
            at%d(l) = sqrt(1 - min(at%p(l), at%r(l))*y)
            at%z(l) = 1.0_wp
        end do
    end subroutine begin

    !> The form with the smaller nu, and the angle there.
    pure subroutine begin_angles(n, of, at)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        type(long_lanes), intent(inout) :: at
        real(wp) :: first, mirror, nu
        integer :: l

        do l = 1, n
            first = of%g(l)*(of%g(l)*at%m2(l)**2 + of%b(l)*at%m3(l)**2)
            mirror = of%a(l)*(of%a(l)*at%m2(l)**2 + of%b(l)*at%m1(l)**2)
            at%form(l) = merge(1.0_wp, -1.0_wp, first <= mirror)
            at%nu(l) = min(first, mirror)
            at%bg(l) = of%b(l)*sqrt(at%gg(l))
        end do
        do l = 1, n
            nu = at%nu(l)*at%y(l)
            call base_angle(at%bg(l)*nu*at%s(l)*middle_third_kind(at%p(l)*at%y(l), at%r(l)*at%y(l), nu), &
                            at%ec(l), at%es(l))
        end do
    end subroutine begin_angles

    !> s^2 in the lanes that have at least i doublings; c and d with it.
    pure subroutine double_squares(n, i, at)
        integer, intent(in) :: n
        real(wp), intent(in) :: i
        type(long_lanes), intent(inout) :: at
        real(wp) :: y, c, d, z
        integer :: l

        do l = 1, n
            y = at%y(l)
            z = at%z(l)
            at%old_y(l) = y
            at%old_z(l) = z
            call double_square(max(at%p(l), at%r(l)), min(at%p(l), at%r(l)), y, c, d, z)
            at%y(l) = merge(y, at%y(l), at%squares(l) >= i)
            at%c(l) = merge(c, at%c(l), at%squares(l) >= i)
            at%d(l) = merge(d, at%d(l), at%squares(l) >= i)
            at%z(l) = merge(z, at%z(l), at%squares(l) >= i)
            at%s(l) = sqrt(at%y(l))
        end do
    end subroutine double_squares

    !> A doubling of s, c, d; only in lanes that need i more.
    pure subroutine double_triples(n, i, at)
        integer, intent(in) :: n
        real(wp), intent(in) :: i
        type(long_lanes), intent(inout) :: at
        real(wp) :: s, c, d, z
        integer :: l

        do l = 1, n
            s = at%s(l)
            c = at%c(l)
            d = at%d(l)
            z = at%z(l)
            at%old_y(l) = s*s
            at%old_z(l) = z
            call double_triple(max(at%p(l), at%r(l)), abs(at%delta(l)), s, c, d, z)
            at%s(l) = merge(s, at%s(l), at%triples(l) >= i)
            at%c(l) = merge(c, at%c(l), at%triples(l) >= i)
            at%d(l) = merge(d, at%d(l), at%triples(l) >= i)
            at%z(l) = merge(z, at%z(l), at%triples(l) >= i)
        end do
    end subroutine double_triples

    !> The angle, after the triple, in the lanes with at least i doublings.
    pure subroutine double_angles(n, i, doublings, at)
        integer, intent(in) :: n
        real(wp), intent(in) :: i, doublings(lanes)
        type(long_lanes), intent(inout) :: at
        real(wp) :: ec, es
        integer :: l

        do l = 1, n
            ec = at%ec(l)
            es = at%es(l)
            call double_angle(at%nu(l), at%bg(l), at%old_y(l), at%old_z(l), at%s(l), at%c(l)*at%d(l), &
                              at%z(l), ec, es)
            at%ec(l) = merge(ec, at%ec(l), doublings(l) >= i)
            at%es(l) = merge(es, at%es(l), doublings(l) >= i)
        end do
    end subroutine double_angles

    !> Divides by a denominator that has become small: numerators and angle are then of order one again.
    pure subroutine form_anew(n, with_attitude, at)
        integer, intent(in) :: n
        logical, intent(in) :: with_attitude
        type(long_lanes), intent(inout) :: at
        real(wp) :: inverse
        integer :: l

        do l = 1, n
            if (at%z(l) >= smallest_denominator) cycle
            inverse = 1/at%z(l)
            at%s(l) = at%s(l)*inverse
            at%c(l) = at%c(l)*inverse
            at%d(l) = at%d(l)*inverse
            at%z(l) = 1.0_wp
            if (.not. with_attitude) cycle
            inverse = 1/(abs(at%ec(l)) + abs(at%es(l)))
            at%ec(l) = at%ec(l)*inverse
            at%es(l) = at%es(l)*inverse
        end do
    end subroutine form_anew

    !> The increments of the momentum, and the momentum at mid-step.
    pure subroutine move(n, of, at, work)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        type(long_lanes), intent(inout) :: at
        type(workspace), intent(inout) :: work
        real(wp) :: c, d
        integer :: l

        do l = 1, n
            c = merge(at%c(l), at%d(l), at%delta(l) <= 0.0_wp)
            d = merge(at%d(l), at%c(l), at%delta(l) <= 0.0_wp)
            at%c(l) = c
            at%d(l) = d
            call long_momentum(at%delta(l) <= 0, abs(at%delta(l)), of%a(l), of%b(l), of%g(l), &
                               max(at%gg(l), tiny(1.0_wp)), at%s(l), c, d, at%z(l), at%m1(l), at%m2(l), &
                               at%m3(l), at%n1(l), at%n2(l), at%n3(l), at%n0(l), work%d(l, 1), &
                               work%d(l, 2), work%d(l, 3))
        end do
    end subroutine move

    !> e z, by its norm, less 1.
    pure subroutine turn_lanes(n, of, at, work)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        type(long_lanes), intent(in) :: at
        type(workspace), intent(inout) :: work
        real(wp) :: norm, form, first, last, sine, cosine, along, v0, v2, v3, w0, w1, w2, w3, inverse
        integer :: l

        do l = 1, n
            form = at%form(l)
            first = merge(at%m3(l), at%m1(l), form < 0)
            last = merge(at%m1(l), at%m3(l), form < 0)
            norm = sqrt(at%gg(l))
            call sin_cos(norm*merge(of%last(l), of%first(l), form < 0), sine, cosine)
            along = (sine*at%ec(l) - form*cosine*at%es(l))/max(norm, tiny(1.0_wp))
            cosine = cosine*at%ec(l) + form*sine*at%es(l)
            call long_direction(of%b(l), merge(of%a(l), of%g(l), form < 0), at%s(l), &
                                merge(at%c(l), at%d(l), form < 0), at%z(l), at%n0(l), at%n2(l), &
                                merge(at%n1(l), at%n3(l), form < 0), v0, v2, v3)
            call join_turns(form*cosine, along, first, at%m2(l), last, v0, v2, v3, w1, w2, w3)
            w0 = cosine*v0 - form*along*(at%m2(l)*v2 + last*v3)
            inverse = 1/sqrt(w0*w0 + (w1*w1 + (w2*w2 + w3*w3)))
            work%w0(l) = w0*inverse - 1
            work%w(l, 1) = merge(w3, w1, form < 0)*inverse
            work%w(l, 2) = w2*inverse
            work%w(l, 3) = merge(w1, w3, form < 0)*inverse
        end do
    end subroutine turn_lanes

    include 'all_doublings.inc'

    include 'middle_coefficients.inc'

end module frb_flow_lanes_long
