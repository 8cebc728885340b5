!> The free flow of a block of bodies, one per SIMD lane: the formulas of frb_flow_one in loops of fixed length
!> that the compiler vectorises. What happens to a body depends on itself alone, not on the others of its block,
!> so results are the same for any split of the bodies. A body that is out of reach (many periods in one
!> step, extreme exponents, refused input) is left to the routine for one body.
module frb_flow_block
    use frb_flow_limits, only: short_limit, small_turn_limit, base_limit, square_limit, period_limit, &
        sin_cos_limit, plain_largest, plain_smallest
    use frb_kinds, only: wp
    implicit none
    private

    public :: lanes, block_of_bodies, flow_block

    integer, parameter :: lanes = 24    !! bodies in a block: a few vectors, and small enough for memory to keep up

    !> A block in sorted principal axes, with the parity of the sorting folded into m and the vector part of q.
    type :: block_of_bodies
        real(wp) :: alpha(lanes), beta(lanes), gamma(lanes), a1(lanes), a3(lanes)
        real(wp) :: m(lanes, 3), q(lanes, 0:3)
        integer :: served(lanes)        !! 1 where flow_block advances the body, 0 where it leaves it alone
    end type block_of_bodies

contains

    !> Advances the bodies of a block by 2 t: m, and q when `with_attitude`. `served` on entry: 1 for bodies to
    !> advance; bodies out of reach come back with 0, unchanged. Bodies with 0 must hold finite numbers.
    subroutine flow_block(bodies, t, with_attitude)
        type(block_of_bodies), intent(inout) :: bodies
        real(wp), intent(in) :: t
        logical, intent(in) :: with_attitude
        real(wp) :: m1(lanes), m2(lanes), m3(lanes), a(lanes), b(lanes), g(lanes), p(lanes), r(lanes)
        real(wp) :: nu(lanes), gg(lanes), angle(lanes), cosm1(lanes), form(lanes)
        real(wp) :: d1(lanes), d2(lanes), d3(lanes), v0(lanes), v2(lanes), v3(lanes)
        real(wp) :: long(lanes)
        real(wp) :: square, z0, z1, z2, z3, y2, y3, e1, e2, e3, w0, w1, w2, w3
        integer :: l, reached, resting, many_long

        many_long = 0
        resting = 0
        do l = 1, lanes
            a(l) = bodies%alpha(l)*t
            b(l) = bodies%beta(l)*t
            g(l) = bodies%gamma(l)*t
            m1(l) = bodies%m(l, 1)
            m2(l) = bodies%m(l, 2)
            m3(l) = bodies%m(l, 3)
            gg(l) = m1(l)**2 + m2(l)**2 + m3(l)**2
            y2 = b(l)*m1(l)**2 + a(l)*m2(l)**2
            y3 = g(l)*m2(l)**2 + b(l)*m3(l)**2
            p(l) = g(l)*y2
            r(l) = a(l)*y3
            ! Of the two mirror forms the one with the smaller parameter nu of the third kind.
            nu(l) = min(g(l)*y3, a(l)*y2)
            form(l) = merge(1.0_wp, -1.0_wp, g(l)*y3 <= a(l)*y2)
            square = (bodies%a1(l)*t)**2*gg(l)
            reached = merge(1, 0, max(p(l), r(l)) <= period_limit .and. square <= sin_cos_limit**2)
            resting = resting + (1 - reached)
            bodies%served(l) = iand(bodies%served(l), reached)
            long(l) = merge(1.0_wp, 0.0_wp, max(p(l), r(l)) > short_limit .or. square > small_turn_limit)
            long(l) = merge(long(l), 0.0_wp, bodies%served(l) == 1)
            many_long = many_long + merge(1, 0, long(l) > 0.0_wp)
        end do
        if (resting > 0) call rest_lanes()
        if (many_long == 0) then
            call short_steps()
        else
            call mixed_steps()
        end if
        if (with_attitude) then
            do l = 1, lanes
                call unit_increment(v0(l), v2(l), v3(l), z0, z2, z3)
                z1 = merge(0.0_wp, z3, form(l) > 0.0_wp)
                z3 = merge(z3, 0.0_wp, form(l) > 0.0_wp)
                e1 = angle(l)*m1(l)
                e2 = angle(l)*m2(l)
                e3 = angle(l)*m3(l)
                call join_turns(cosm1(l), e1, e2, e3, z0, z1, z2, z3, w1, w2, w3)
                call close_turn(cosm1(l), e1, e2, e3, z0, z1, z2, z3, w0, w1, w2, w3)
                call turn(w0, w1, w2, w3, bodies%q(l, 0), bodies%q(l, 1), bodies%q(l, 2), bodies%q(l, 3))
            end do
        end if
        do l = 1, lanes
            bodies%m(l, 1) = m1(l) + d1(l)
            bodies%m(l, 2) = m2(l) + d2(l)
            bodies%m(l, 3) = m3(l) + d3(l)
        end do

    contains

        !> Lanes out of reach: no number of theirs may overflow on the way.
        subroutine rest_lanes()
            do l = 1, lanes
                if (bodies%served(l) == 1) cycle
                m1(l) = 0.0_wp
                m2(l) = 0.0_wp
                m3(l) = 0.0_wp
                gg(l) = 0.0_wp
                p(l) = 0.0_wp
                r(l) = 0.0_wp
                nu(l) = 0.0_wp
            end do
        end subroutine rest_lanes

        !> Short and long lanes in one block: each loop runs over all lanes, and each lane takes its own result.
        subroutine mixed_steps()
            real(wp) :: p_kept(lanes), r_kept(lanes), nu_kept(lanes)

            p_kept = p
            r_kept = r
            nu_kept = nu
            p = merge(0.0_wp, p, long > 0.0_wp)
            r = merge(0.0_wp, r, long > 0.0_wp)
            nu = merge(0.0_wp, nu, long > 0.0_wp)
            call short_steps()
            p = p_kept
            r = r_kept
            nu = nu_kept
            call long_steps()
        end subroutine mixed_steps

        subroutine short_steps()
            real(wp) :: y, scd, u, w, k, k0, a23, b31, g12, first, second, sinc, n

            do l = 1, lanes
                a23 = a(l)*(m2(l)*m3(l))
                b31 = b(l)*(m3(l)*m1(l))
                g12 = g(l)*(m1(l)*m2(l))
                call short_series(p(l) + r(l), p(l)*r(l), y, scd)
                u = p(l)*y
                w = r(l)*y
                k0 = merge(a(l)*g(l)*m2(l)**2, 0.0_wp, long(l) <= 0.0_wp)
                k = k0*y
                call short_momentum(u, w, 4*k0*(scd*scd), scd, m1(l), m2(l), m3(l), a23, b31, g12, &
                                    d1(l), d2(l), d3(l))
                if (with_attitude) then
                    n = nu(l)*y
                    first = 1 - merge(w, u, form(l) > 0.0_wp)
                    second = merge(g(l), -a(l), form(l) > 0.0_wp)
                    v0(l) = first*(1 - k)
                    v2(l) = -second*first*(m2(l)*scd + b31*y)
                    v3(l) = -form(l)*b(l)*(merge(m3(l), m1(l), form(l) > 0.0_wp)*scd &
                                           - merge(g12, a23, form(l) > 0.0_wp)*y*first)
                    angle(l) = merge(bodies%a1(l), bodies%a3(l), form(l) > 0.0_wp)*t &
                               - form(l)*b(l)*n*sqrt(y)*short_third_kind(u, w, n)
                    call small_turn(angle(l)*angle(l)*gg(l), sinc, cosm1(l))
                    angle(l) = angle(l)*sinc
                end if
            end do
        end subroutine short_steps

        subroutine long_steps()
            real(wp) :: s(lanes), y(lanes), c(lanes), d(lanes), cd(lanes), ec(lanes), es(lanes)
            real(wp) :: delta(lanes), bg(lanes), f(lanes), triples(lanes), squares(lanes)
            real(wp) :: norm, n1, n2, n3, cp, dr, sine, cosine, new_y, new_s, new_c, new_d, new_ec, new_es, n
            integer :: most_triples, most_squares, over, i

            do l = 1, lanes
                bg(l) = b(l)*sqrt(gg(l))
                delta(l) = b(l)*((a(l)*m3(l)**2) - (g(l)*m1(l)**2))     ! 0 on the separatrix with FMA too
                f(l) = 1.0_wp
                triples(l) = 0.0_wp
                squares(l) = 0.0_wp
            end do
            ! Each body has its own numbers of doublings; the loops run to the largest of them.
            most_triples = 0
            do
                over = 0
                do l = 1, lanes
                    n = merge(1.0_wp, 0.0_wp, long(l) > 0.0_wp .and. max(p(l), r(l))*f(l)*f(l) > square_limit)
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
                    n = merge(1.0_wp, 0.0_wp, long(l) > 0.0_wp .and. max(p(l), r(l), nu(l))*f(l)*f(l) > base_limit)
                    squares(l) = squares(l) + n
                    f(l) = f(l)*(1 - 0.5_wp*n)
                    over = over + merge(1, 0, n > 0.0_wp)
                end do
                if (over == 0) exit
                most_squares = most_squares + 1
            end do
            do l = 1, lanes
                call base_series(p(l), r(l), f(l), s(l), y(l))
                call base_angle(p(l), r(l), nu(l), bg(l), s(l), y(l), ec(l), es(l))
            end do
            do i = 1, most_squares
                n = real(i, wp)
                do l = 1, lanes
                    new_y = y(l)
                    new_ec = ec(l)
                    new_es = es(l)
                    call double_square(p(l), r(l), new_y, new_s, cd(l))
                    call double_angle(nu(l), bg(l), y(l), new_s, cd(l), new_ec, new_es)
                    y(l) = merge(new_y, y(l), squares(l) >= n)
                    s(l) = merge(new_s, s(l), squares(l) >= n)
                    ec(l) = merge(new_ec, ec(l), squares(l) >= n)
                    es(l) = merge(new_es, es(l), squares(l) >= n)
                end do
            end do
            do l = 1, lanes
                c(l) = sqrt(1 - max(p(l), r(l))*y(l))
                d(l) = sqrt(1 - min(p(l), r(l))*y(l))
            end do
            do i = 1, most_triples
                n = real(i, wp)
                do l = 1, lanes
                    new_s = s(l)
                    new_c = c(l)
                    new_d = d(l)
                    new_ec = ec(l)
                    new_es = es(l)
                    call double_triple(max(p(l), r(l)), abs(delta(l)), new_s, new_c, new_d)
                    call double_angle(nu(l), bg(l), s(l)*s(l), new_s, new_c*new_d, new_ec, new_es)
                    s(l) = merge(new_s, s(l), triples(l) >= n)
                    c(l) = merge(new_c, c(l), triples(l) >= n)
                    d(l) = merge(new_d, d(l), triples(l) >= n)
                    ec(l) = merge(new_ec, ec(l), triples(l) >= n)
                    es(l) = merge(new_es, es(l), triples(l) >= n)
                end do
            end do
            do l = 1, lanes
                cp = merge(c(l), d(l), delta(l) <= 0.0_wp)
                dr = merge(d(l), c(l), delta(l) <= 0.0_wp)
                call long_momentum(delta(l) <= 0.0_wp, a(l), b(l), g(l), s(l), cp, dr, m1(l), m2(l), m3(l), &
                                   1.0_wp, n1, n2, n3, e1, e2, e3)
                d1(l) = merge(e1, d1(l), long(l) > 0.0_wp)
                d2(l) = merge(e2, d2(l), long(l) > 0.0_wp)
                d3(l) = merge(e3, d3(l), long(l) > 0.0_wp)
                v0(l) = merge(merge(dr, cp, form(l) > 0.0_wp), v0(l), long(l) > 0.0_wp)
                v2(l) = merge(-merge(g(l)*dr, -a(l)*cp, form(l) > 0.0_wp)*s(l)*n2, v2(l), long(l) > 0.0_wp)
                v3(l) = merge(-form(l)*b(l)*s(l)*merge(n3, n1, form(l) > 0.0_wp), v3(l), long(l) > 0.0_wp)
                norm = sqrt(gg(l))
                call sin_cos(form(l)*norm*(merge(bodies%a1(l), bodies%a3(l), form(l) > 0.0_wp)*t), sine, cosine)
                n = 1.5_wp - 0.5_wp*(ec(l)*ec(l) + es(l)*es(l))     ! (ec, es) back to norm one
                cosm1(l) = merge((cosine*ec(l) + sine*es(l))*n - 1, cosm1(l), long(l) > 0.0_wp)
                norm = form(l)*n/max(norm, tiny(1.0_wp))
                angle(l) = merge((sine*ec(l) - cosine*es(l))*norm, angle(l), long(l) > 0.0_wp)
            end do
        end subroutine long_steps

    end subroutine flow_block

    include 'flow_formulas.inc'

end module frb_flow_block
