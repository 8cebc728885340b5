!> The free flow of a block of bodies, one per SIMD lane: the formulas of frb_flow_one in loops of fixed
!> length that the compiler vectorises. What happens to a body depends on itself alone, not on the others of
!> its block, so results are the same for any split of the bodies. A body that is out of reach (many periods
!> in one step, extreme exponents, refused input) is left to the routine for one body.
module frb_flow_block
    use frb_flow_block_long, only: long_steps
    use frb_flow_lanes, only: lanes, block_of_bodies, workspace
    use frb_flow_limits, only: tiny_limit, short_limit, small_turn_limit, period_limit, sin_cos_limit
    use frb_kinds, only: wp
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: flow_block

contains

    !> Advances the bodies of a block by 2 t: m, and q when `with_attitude`. `served` on entry: 1 for bodies
    !> to advance; bodies out of reach come back with 0 and m = 0: their state is the caller's. Bodies with 0
    !> must come with m = 0 and finite numbers.
    subroutine flow_block(bodies, t, with_attitude, all_served)
        type(block_of_bodies), intent(inout) :: bodies
        real(wp), intent(in) :: t
        logical, intent(in) :: with_attitude
        logical, intent(out) :: all_served      !! every lane of a whole block was advanced
        type(workspace) :: work
        real(wp) :: nu_first, nu_mirror
        integer(int64) :: reach, square
        integer :: l, many_long

        reach = 0_int64
        square = 0_int64
        do l = 1, lanes
            call orbit_constants(bodies%alpha(l), bodies%beta(l), bodies%gamma(l), t, bodies%m(l, 1), &
                                 bodies%m(l, 2), bodies%m(l, 3), work%a(l), work%b(l), work%g(l), &
                                 work%gg(l), work%p(l), work%r(l), nu_first, nu_mirror)
            work%k(l) = work%a(l)*work%g(l)*bodies%m(l, 2)**2
            ! Of the two mirror forms the one with the smaller parameter nu of the third kind.
            work%nu(l) = min(nu_first, nu_mirror)
            work%form(l) = merge(1.0_wp, -1.0_wp, nu_first <= nu_mirror)
            ! The largest of all lanes: the bits of numbers >= 0 are ordered as the numbers are.
            reach = max(reach, transfer(max(work%p(l), work%r(l)), 0_int64))
            square = max(square, transfer((bodies%a1(l)*t)**2*work%gg(l), 0_int64))
        end do
        many_long = 0
        all_served = .true.
        if (reach > transfer(short_limit, 0_int64) .or. square > transfer(small_turn_limit, 0_int64)) then
            call sort_lanes(bodies, t, work, many_long)
            all_served = all(bodies%served == 1)
        end if
        ! Lanes of all sorts in one block: each loop runs over all lanes, each lane takes its own result.
        call tiny_triple(with_attitude, work)
        if (reach > transfer(tiny_limit, 0_int64)) call short_triple(with_attitude, work)
        call short_steps(bodies, t, with_attitude, work)
        if (many_long > 0) call long_steps(bodies, t, with_attitude, work)
        if (with_attitude) then
            do l = 1, lanes
                call turn(work%w0(l), work%w1(l), work%w2(l), work%w3(l), &
                          bodies%q(l, 0), bodies%q(l, 1), bodies%q(l, 2), bodies%q(l, 3))
            end do
        end if
        do l = 1, lanes
            bodies%m(l, 1) = bodies%m(l, 1) + work%d1(l)
            bodies%m(l, 2) = bodies%m(l, 2) + work%d2(l)
            bodies%m(l, 3) = bodies%m(l, 3) + work%d3(l)
        end do
    end subroutine flow_block

    !> Tells long lanes and lanes out of reach. Long ones run through the routines for short steps with
    !> p = r = nu = k = 0, and those out of reach rest, so that no number overflows on the way.
    subroutine sort_lanes(bodies, t, work, many_long)
        type(block_of_bodies), intent(inout) :: bodies
        real(wp), intent(in) :: t
        type(workspace), intent(inout) :: work
        integer, intent(out) :: many_long
        real(wp) :: reach, square
        integer :: l

        many_long = 0
        do l = 1, lanes
            reach = max(work%p(l), work%r(l))
            square = (bodies%a1(l)*t)**2*work%gg(l)
            if (reach > period_limit .or. square > sin_cos_limit**2) bodies%served(l) = 0
            work%long(l) = 0.0_wp
            if (bodies%served(l) == 0) then
                bodies%m(l, :) = 0.0_wp
                work%gg(l) = 0.0_wp
                work%p(l) = 0.0_wp
                work%r(l) = 0.0_wp
                work%nu(l) = 0.0_wp
                work%k(l) = 0.0_wp
            else if (reach > short_limit .or. square > small_turn_limit) then
                work%long(l) = 1.0_wp
                many_long = many_long + 1
            end if
        end do
        do l = 1, lanes
            work%long_p(l) = work%p(l)
            work%long_r(l) = work%r(l)
            work%long_nu(l) = work%nu(l)
            work%p(l) = merge(work%p(l), 0.0_wp, work%long(l) <= 0.0_wp)
            work%r(l) = merge(work%r(l), 0.0_wp, work%long(l) <= 0.0_wp)
            work%nu(l) = merge(work%nu(l), 0.0_wp, work%long(l) <= 0.0_wp)
            work%k(l) = merge(work%k(l), 0.0_wp, work%long(l) <= 0.0_wp)
        end do
    end subroutine sort_lanes

    !> The triple and the integral of the third kind by the first terms of their series.
    subroutine tiny_triple(with_attitude, work)
        logical, intent(in) :: with_attitude
        type(workspace), intent(inout) :: work
        real(wp) :: p, r
        integer :: l

        do l = 1, lanes
            p = work%p(l)
            r = work%r(l)
            call tiny_series(p + r, p*r, work%y(l), work%scd(l))
            if (with_attitude) work%third(l) = tiny_third_kind(p + r, p*r, work%nu(l))
        end do
    end subroutine tiny_triple

    !> The same with all terms of the series, for lanes that the first ones do not serve.
    subroutine short_triple(with_attitude, work)
        logical, intent(in) :: with_attitude
        type(workspace), intent(inout) :: work
        real(wp) :: p, r, y, scd, third
        integer :: l

        do l = 1, lanes
            p = work%p(l)
            r = work%r(l)
            call short_series(p + r, p*r, y, scd)
            work%y(l) = merge(work%y(l), y, max(p, r) <= tiny_limit)
            work%scd(l) = merge(work%scd(l), scd, max(p, r) <= tiny_limit)
            if (with_attitude) then
                third = short_third_kind(p + r, p*r, work%nu(l))
                work%third(l) = merge(work%third(l), third, max(p, r) <= tiny_limit)
            end if
        end do
    end subroutine short_triple

    !> Short steps: increments of m; the turn when `with_attitude`. Several small loops: the processor then
    !> works on all vectors of a block at a time, and constants stay in registers.
    subroutine short_steps(bodies, t, with_attitude, work)
        type(block_of_bodies), intent(in) :: bodies
        real(wp), intent(in) :: t
        logical, intent(in) :: with_attitude
        type(workspace), intent(inout) :: work
        real(wp) :: u(lanes), w(lanes), along(lanes), cosm1(lanes)
        real(wp) :: a23(lanes), b31(lanes), g12(lanes), square(lanes), dot(lanes), v0(lanes)
        real(wp) :: w1(lanes), w2(lanes), w3(lanes)
        real(wp) :: v2, v3, angle, first, last
        integer :: l

        do l = 1, lanes
            a23(l) = work%a(l)*(bodies%m(l, 2)*bodies%m(l, 3))
            b31(l) = work%b(l)*(bodies%m(l, 3)*bodies%m(l, 1))
            g12(l) = work%g(l)*(bodies%m(l, 1)*bodies%m(l, 2))
            u(l) = work%p(l)*work%y(l)
            w(l) = work%r(l)*work%y(l)
        end do
        do l = 1, lanes
            call short_momentum(u(l), w(l), work%k(l)*(work%scd(l)*work%scd(l)), work%scd(l), &
                                bodies%m(l, 1), bodies%m(l, 2), bodies%m(l, 3), a23(l), b31(l), g12(l), &
                                work%d1(l), work%d2(l), work%d3(l))
        end do
        if (.not. with_attitude) return
        do l = 1, lanes
            angle = merge(bodies%a1(l), bodies%a3(l), work%form(l) > 0.0_wp)*t &
                    - work%form(l)*work%b(l)*(work%nu(l)*work%third(l))
            call small_turn(angle*angle*work%gg(l), along(l), cosm1(l))
            along(l) = angle*along(l)
        end do
        ! The mirror form is the first one with the axes (3, 2, 1).
        do l = 1, lanes
            first = merge(bodies%m(l, 1), bodies%m(l, 3), work%form(l) > 0.0_wp)
            last = merge(bodies%m(l, 3), bodies%m(l, 1), work%form(l) > 0.0_wp)
            call short_direction(work%b(l), merge(work%g(l), work%a(l), work%form(l) > 0.0_wp), &
                                 merge(w(l), u(l), work%form(l) > 0.0_wp), work%k(l)*work%y(l), work%y(l), &
                                 work%scd(l), bodies%m(l, 2), last, b31(l), &
                                 merge(g12(l), a23(l), work%form(l) > 0.0_wp), v0(l), v2, v3)
            call join_turns(work%form(l)*(1 + cosm1(l)), along(l), first, bodies%m(l, 2), last, 1 + v0(l), &
                            v2, v3, w1(l), w2(l), w3(l))
            dot(l) = work%form(l)*along(l)*(bodies%m(l, 2)*v2 + last*v3)
            square(l) = v0(l)*(2 + v0(l)) + (v2*v2 + v3*v3)
        end do
        do l = 1, lanes
            call small_unit_turn(cosm1(l), v0(l), dot(l), short_norm(square(l)), work%w0(l), w1(l), &
                                 w2(l), w3(l))
            work%w1(l) = merge(w1(l), w3(l), work%form(l) > 0.0_wp)
            work%w2(l) = w2(l)
            work%w3(l) = merge(w3(l), w1(l), work%form(l) > 0.0_wp)
        end do
    end subroutine short_steps

    include 'orbit_formulas.inc'

    include 'short_formulas.inc'

    include 'turn_formulas.inc'

end module frb_flow_block
