!> The free flow of a block of bodies, one per SIMD lane: the formulas of frb_flow_one in loops of fixed
!> length that the compiler vectorises. What happens to a body depends on itself alone, not on the others of
!> its block, so results are the same for any split of the bodies. A body that is out of reach (many periods
!> in one step, extreme exponents, refused input) is left to the routine for one body.
module frb_flow_block
    use frb_flow_limits, only: tiny_limit, short_limit, small_turn_limit, middle_limit, square_limit, &
        period_limit, smallest_denominator, sin_cos_limit
    use frb_kinds, only: wp
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: lanes, block_of_bodies, flow_block

    integer, parameter :: lanes = 24    !! bodies in a block: a few vectors, and memory keeps up

    !> A block in sorted principal axes, right-handed: an odd sorting turns the sign of the last one.
    type :: block_of_bodies
        real(wp) :: alpha(lanes), beta(lanes), gamma(lanes), a1(lanes), a3(lanes)
        real(wp) :: m(lanes, 3), q(lanes, 0:3)
        integer :: served(lanes)        !! 1 where flow_block advances the body, else 0
    end type block_of_bodies

    !> What the loops of flow_block hand to one another, one number a lane.
    type :: workspace
        real(wp) :: gg(lanes)                                       !! square of the momentum
        real(wp) :: a(lanes), b(lanes), g(lanes), p(lanes), r(lanes), nu(lanes), k(lanes)
        real(wp) :: form(lanes)                                     !! 1: first form, -1: its mirror image
        real(wp) :: long(lanes)                                     !! 1: beyond the short series, else 0
        real(wp) :: long_p(lanes), long_r(lanes), long_nu(lanes)    !! p, r, nu of long lanes, see sort_lanes
        real(wp) :: y(lanes), scd(lanes), third(lanes)              !! s^2, s c d, H of short steps
        real(wp) :: d1(lanes), d2(lanes), d3(lanes)                 !! increments of the momentum
        real(wp) :: w0(lanes), w1(lanes), w2(lanes), w3(lanes)      !! the turn e z - 1
    end type workspace

contains

    !> Advances the bodies of a block by 2 t: m, and q when `with_attitude`. `served` on entry: 1 for bodies
    !> to advance; bodies out of reach come back with 0 and m = 0: their state is the caller's. Bodies with 0
    !> must come with m = 0 and finite numbers.
    subroutine flow_block(bodies, t, with_attitude)
        type(block_of_bodies), intent(inout) :: bodies
        real(wp), intent(in) :: t
        logical, intent(in) :: with_attitude
        type(workspace) :: work
        real(wp) :: pt, rt
        integer(int64) :: reach, square
        integer :: l, many_long

        reach = 0_int64
        square = 0_int64
        do l = 1, lanes
            work%a(l) = bodies%alpha(l)*t
            work%b(l) = bodies%beta(l)*t
            work%g(l) = bodies%gamma(l)*t
            work%gg(l) = bodies%m(l, 1)**2 + bodies%m(l, 2)**2 + bodies%m(l, 3)**2
            pt = work%b(l)*bodies%m(l, 1)**2 + work%a(l)*bodies%m(l, 2)**2
            rt = work%g(l)*bodies%m(l, 2)**2 + work%b(l)*bodies%m(l, 3)**2
            work%p(l) = work%g(l)*pt
            work%r(l) = work%a(l)*rt
            work%k(l) = work%a(l)*work%g(l)*bodies%m(l, 2)**2
            ! Of the two mirror forms the one with the smaller parameter nu of the third kind.
            work%nu(l) = min(work%g(l)*rt, work%a(l)*pt)
            work%form(l) = merge(1.0_wp, -1.0_wp, work%g(l)*rt <= work%a(l)*pt)
            ! The largest of all lanes: the bits of numbers >= 0 are ordered as the numbers are.
            reach = max(reach, transfer(max(work%p(l), work%r(l)), 0_int64))
            square = max(square, transfer((bodies%a1(l)*t)**2*work%gg(l), 0_int64))
        end do
        many_long = 0
        if (reach > transfer(short_limit, 0_int64) .or. square > transfer(small_turn_limit, 0_int64)) then
            call sort_lanes(bodies, t, work, many_long)
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

    !> Steps of lanes beyond the short series, by doubling; others keep what they have.
    subroutine long_steps(bodies, t, with_attitude, work)
        type(block_of_bodies), intent(in) :: bodies
        real(wp), intent(in) :: t
        logical, intent(in) :: with_attitude
        type(workspace), intent(inout) :: work
        real(wp) :: s(lanes), y(lanes), z(lanes), c(lanes), d(lanes), ec(lanes), es(lanes)
        real(wp) :: delta(lanes), bg(lanes), f(lanes), triples(lanes), squares(lanes)
        real(wp) :: norm, n0, n1, n2, n3, cp, dr, sine, cosine, along, n, v0, v2, v3, e0, form, first, last
        real(wp) :: new_y, new_z, new_s, new_c, new_d, new_ec, new_es, w0, w1, w2, w3
        integer :: most_triples, most_squares, over, i, l

        do l = 1, lanes
            bg(l) = work%b(l)*sqrt(work%gg(l))
            ! The parentheses keep this 0 on the separatrix with FMA too.
            delta(l) = work%b(l)*((work%a(l)*bodies%m(l, 3)**2) - (work%g(l)*bodies%m(l, 1)**2))
            f(l) = 1.0_wp
            triples(l) = 0.0_wp
            squares(l) = 0.0_wp
        end do
        ! Each body has its own numbers of doublings; the loops run to the largest of them.
        most_triples = 0
        do
            over = 0
            do l = 1, lanes
                n = max(work%long_p(l), work%long_r(l))*f(l)*f(l)
                n = merge(1.0_wp, 0.0_wp, work%long(l) > 0.0_wp .and. n > square_limit)
                triples(l) = triples(l) + n
                f(l) = f(l)*(1 - 0.5_wp*n)
                over = over + merge(1, 0, n > 0.0_wp)
            end do
            if (over == 0) exit
            most_triples = most_triples + 1
        end do
        most_squares = 0
        do
            over = 0
            do l = 1, lanes
                n = max(work%long_p(l), work%long_r(l))*f(l)*f(l)     ! nu is never larger
                n = merge(1.0_wp, 0.0_wp, work%long(l) > 0.0_wp .and. n > middle_limit)
                squares(l) = squares(l) + n
                f(l) = f(l)*(1 - 0.5_wp*n)
                over = over + merge(1, 0, n > 0.0_wp)
            end do
            if (over == 0) exit
            most_squares = most_squares + 1
        end do
        do l = 1, lanes
            n = f(l)*f(l)
            call middle_series((work%long_p(l) + work%long_r(l))*n, work%long_p(l)*work%long_r(l)*(n*n), &
                               y(l), new_y)
            y(l) = y(l)*n
            s(l) = sqrt(y(l))
            n = work%long_nu(l)*y(l)
            call base_angle(bg(l)*n*s(l)*middle_third_kind(work%long_p(l)*y(l), work%long_r(l)*y(l), n), &
                            ec(l), es(l))
            c(l) = sqrt(1 - max(work%long_p(l), work%long_r(l))*y(l))
            d(l) = sqrt(1 - min(work%long_p(l), work%long_r(l))*y(l))
            z(l) = 1.0_wp
        end do
        do i = 1, most_squares
            n = real(i, wp)
            do l = 1, lanes
                new_y = y(l)
                new_z = z(l)
                new_s = 2*s(l)*((c(l)*d(l))*z(l))   ! for the angle; that of the motion is the root of y
                new_ec = ec(l)
                new_es = es(l)
                call double_square(max(work%long_p(l), work%long_r(l)), min(work%long_p(l), work%long_r(l)), &
                                   new_y, new_c, new_d, new_z)
                call double_angle(work%long_nu(l), bg(l), y(l), z(l), new_s, new_c*new_d, new_z, new_ec, &
                                  new_es)
                y(l) = merge(new_y, y(l), squares(l) >= n)
                z(l) = merge(new_z, z(l), squares(l) >= n)
                s(l) = merge(new_s, s(l), squares(l) >= n)
                c(l) = merge(new_c, c(l), squares(l) >= n)
                d(l) = merge(new_d, d(l), squares(l) >= n)
                ec(l) = merge(new_ec, ec(l), squares(l) >= n)
                es(l) = merge(new_es, es(l), squares(l) >= n)
            end do
        end do
        do l = 1, lanes
            s(l) = sqrt(y(l))
        end do
        do i = 1, most_triples
            n = real(i, wp)
            do l = 1, lanes
                new_s = s(l)
                new_c = c(l)
                new_d = d(l)
                new_z = z(l)
                new_ec = ec(l)
                new_es = es(l)
                call double_triple(max(work%long_p(l), work%long_r(l)), abs(delta(l)), new_s, new_c, new_d, &
                                   new_z)
                call double_angle(work%long_nu(l), bg(l), s(l)*s(l), z(l), new_s, new_c*new_d, new_z, &
                                  new_ec, new_es)
                s(l) = merge(new_s, s(l), triples(l) >= n)
                c(l) = merge(new_c, c(l), triples(l) >= n)
                d(l) = merge(new_d, d(l), triples(l) >= n)
                z(l) = merge(new_z, z(l), triples(l) >= n)
                ec(l) = merge(new_ec, ec(l), triples(l) >= n)
                es(l) = merge(new_es, es(l), triples(l) >= n)
            end do
            do l = 1, lanes
                n = merge(1/z(l), 1.0_wp, z(l) < smallest_denominator)
                s(l) = s(l)*n
                c(l) = c(l)*n
                d(l) = d(l)*n
                n = merge(1/(abs(ec(l)) + abs(es(l))), 1.0_wp, z(l) < smallest_denominator)
                ec(l) = ec(l)*n
                es(l) = es(l)*n
                z(l) = merge(1.0_wp, z(l), z(l) < smallest_denominator)
            end do
        end do
        do l = 1, lanes
            cp = merge(c(l), d(l), delta(l) <= 0.0_wp)
            dr = merge(d(l), c(l), delta(l) <= 0.0_wp)
            call long_momentum(delta(l) <= 0.0_wp, work%a(l), work%b(l), work%g(l), s(l), cp, dr, z(l), &
                               bodies%m(l, 1), bodies%m(l, 2), bodies%m(l, 3), n1, n2, n3, n0, w1, w2, w3)
            work%d1(l) = merge(w1, work%d1(l), work%long(l) > 0.0_wp)
            work%d2(l) = merge(w2, work%d2(l), work%long(l) > 0.0_wp)
            work%d3(l) = merge(w3, work%d3(l), work%long(l) > 0.0_wp)
            if (with_attitude) then
                form = work%form(l)
                first = merge(bodies%m(l, 1), bodies%m(l, 3), form > 0.0_wp)
                last = merge(bodies%m(l, 3), bodies%m(l, 1), form > 0.0_wp)
                norm = sqrt(work%gg(l))
                call sin_cos(norm*(merge(bodies%a1(l), bodies%a3(l), form > 0.0_wp)*t), sine, cosine)
                along = (sine*ec(l) - form*cosine*es(l))/max(norm, tiny(1.0_wp))
                cosine = cosine*ec(l) + form*sine*es(l)
                call long_direction(work%b(l), merge(work%g(l), work%a(l), form > 0.0_wp), s(l), &
                                    merge(dr, cp, form > 0.0_wp), z(l), n0, n2, &
                                    merge(n3, n1, form > 0.0_wp), v0, v2, v3)
                call join_turns(form*cosine, along, first, bodies%m(l, 2), last, v0, v2, v3, w1, w2, w3)
                e0 = cosine*v0 - form*along*(bodies%m(l, 2)*v2 + last*v3)
                call unit_turn(e0, w0, w1, w2, w3)
                work%w0(l) = merge(w0, work%w0(l), work%long(l) > 0.0_wp)
                work%w1(l) = merge(merge(w1, w3, form > 0.0_wp), work%w1(l), work%long(l) > 0.0_wp)
                work%w2(l) = merge(w2, work%w2(l), work%long(l) > 0.0_wp)
                work%w3(l) = merge(merge(w3, w1, form > 0.0_wp), work%w3(l), work%long(l) > 0.0_wp)
            end if
        end do
    end subroutine long_steps

    include 'short_formulas.inc'

    include 'middle_formulas.inc'

    include 'long_formulas.inc'

    include 'turn_formulas.inc'

end module frb_flow_block
