!> The lanes of a block whose step is beyond the short series: s^2 by its series at a fraction of the time and
!> doublings, as in frb_flow_long. A module of its own: blocks of short steps then pay nothing for it.
module frb_flow_block_long
    use frb_flow_lanes, only: lanes, block_of_bodies, workspace
    use frb_flow_limits, only: middle_limit, square_limit, smallest_denominator
    use frb_kinds, only: wp
    implicit none
    private

    public :: long_steps

contains

    !> Steps of lanes beyond the short series, by doubling; others keep what they have.
    subroutine long_steps(bodies, t, with_attitude, work)
        type(block_of_bodies), intent(in) :: bodies
        real(wp), intent(in) :: t
        logical, intent(in) :: with_attitude
        type(workspace), intent(inout) :: work
        real(wp) :: pmax(lanes), pmin(lanes), delta(lanes), f(lanes), triples(lanes), squares(lanes)
        real(wp) :: s(lanes), y(lanes), z(lanes), c(lanes), d(lanes), old_y(lanes), old_z(lanes)
        real(wp) :: norm(lanes), bg(lanes), ec(lanes), es(lanes)
        real(wp) :: n1(lanes), n2(lanes), n3(lanes), n0(lanes), cp(lanes), dr(lanes)
        real(wp) :: n, sine, cosine, along, v0, v2, v3, e0, form, first, last
        real(wp) :: new_y, new_s, new_c, new_d, new_z, w0, w1, w2, w3
        integer :: most_triples, most_squares, i, l

        do l = 1, lanes
            pmax(l) = max(work%long_p(l), work%long_r(l))
            pmin(l) = min(work%long_p(l), work%long_r(l))
            delta(l) = orbit_difference(work%a(l), work%b(l), work%g(l), bodies%m(l, 1), bodies%m(l, 3))
            norm(l) = sqrt(work%gg(l))
            bg(l) = work%b(l)*norm(l)
            f(l) = 1.0_wp
        end do
        ! Each body has its own numbers of doublings; the loops run to the largest of them.
        call count_halvings(square_limit, pmax, work%long, f, triples, most_triples)
        call count_halvings(middle_limit, pmax, work%long, f, squares, most_squares)    ! nu <= pmax
        do l = 1, lanes
            n = f(l)*f(l)
            call middle_series((work%long_p(l) + work%long_r(l))*n, work%long_p(l)*work%long_r(l)*(n*n), &
                               y(l), e0)
            y(l) = y(l)*n
            s(l) = sqrt(y(l))
            z(l) = 1.0_wp
            c(l) = 1.0_wp
            d(l) = 1.0_wp
            ec(l) = 1.0_wp
            es(l) = 0.0_wp
        end do
        if (any(squares <= 0.0_wp .and. work%long > 0.0_wp)) then
            do l = 1, lanes
                c(l) = sqrt(1 - pmax(l)*y(l))
                d(l) = sqrt(1 - pmin(l)*y(l))
            end do
        end if
        if (with_attitude) then
            do l = 1, lanes
                n = work%long_nu(l)*y(l)
                call base_angle(bg(l)*n*s(l)*middle_third_kind(work%long_p(l)*y(l), work%long_r(l)*y(l), n), &
                                ec(l), es(l))
            end do
        end if
        ! The angle in loops of its own: the triple has the same digits whether the angle is wanted or not.
        do i = 1, most_squares
            n = real(i, wp)
            do l = 1, lanes
                old_y(l) = y(l)
                old_z(l) = z(l)
                new_y = y(l)
                new_z = z(l)
                call double_square(pmax(l), pmin(l), new_y, new_c, new_d, new_z)
                y(l) = merge(new_y, y(l), squares(l) >= n)
                z(l) = merge(new_z, z(l), squares(l) >= n)
                c(l) = merge(new_c, c(l), squares(l) >= n)
                d(l) = merge(new_d, d(l), squares(l) >= n)
                s(l) = sqrt(y(l))
            end do
            if (with_attitude) then
                call double_angles(n, squares, work%long_nu, bg, old_y, old_z, s, c, d, z, ec, es)
            end if
        end do
        do i = 1, most_triples
            n = real(i, wp)
            do l = 1, lanes
                old_y(l) = s(l)*s(l)
                old_z(l) = z(l)
                new_s = s(l)
                new_c = c(l)
                new_d = d(l)
                new_z = z(l)
                call double_triple(pmax(l), abs(delta(l)), new_s, new_c, new_d, new_z)
                s(l) = merge(new_s, s(l), triples(l) >= n)
                c(l) = merge(new_c, c(l), triples(l) >= n)
                d(l) = merge(new_d, d(l), triples(l) >= n)
                z(l) = merge(new_z, z(l), triples(l) >= n)
            end do
            if (with_attitude) then
                call double_angles(n, triples, work%long_nu, bg, old_y, old_z, s, c, d, z, ec, es)
            end if
            if (any(z < smallest_denominator)) call form_anew(s, c, d, z, ec, es)
        end do
        do l = 1, lanes
            cp(l) = merge(c(l), d(l), delta(l) <= 0.0_wp)
            dr(l) = merge(d(l), c(l), delta(l) <= 0.0_wp)
            call long_momentum(delta(l) <= 0.0_wp, work%a(l), work%b(l), work%g(l), &
                               max(work%gg(l), tiny(1.0_wp)), s(l), cp(l), dr(l), z(l), bodies%m(l, 1), &
                               bodies%m(l, 2), bodies%m(l, 3), n1(l), n2(l), n3(l), n0(l), w1, w2, w3)
            work%d1(l) = merge(w1, work%d1(l), work%long(l) > 0.0_wp)
            work%d2(l) = merge(w2, work%d2(l), work%long(l) > 0.0_wp)
            work%d3(l) = merge(w3, work%d3(l), work%long(l) > 0.0_wp)
        end do
        if (.not. with_attitude) return
        do l = 1, lanes
            form = work%form(l)
            first = merge(bodies%m(l, 1), bodies%m(l, 3), form > 0.0_wp)
            last = merge(bodies%m(l, 3), bodies%m(l, 1), form > 0.0_wp)
            call sin_cos(norm(l)*(merge(bodies%a1(l), bodies%a3(l), form > 0.0_wp)*t), sine, cosine)
            along = (sine*ec(l) - form*cosine*es(l))/max(norm(l), tiny(1.0_wp))
            cosine = cosine*ec(l) + form*sine*es(l)
            call long_direction(work%b(l), merge(work%g(l), work%a(l), form > 0.0_wp), s(l), &
                                merge(dr(l), cp(l), form > 0.0_wp), z(l), n0(l), n2(l), &
                                merge(n3(l), n1(l), form > 0.0_wp), v0, v2, v3)
            call join_turns(form*cosine, along, first, bodies%m(l, 2), last, v0, v2, v3, w1, w2, w3)
            e0 = cosine*v0 - form*along*(bodies%m(l, 2)*v2 + last*v3)
            call unit_turn(e0, w0, w1, w2, w3)
            work%w0(l) = merge(w0, work%w0(l), work%long(l) > 0.0_wp)
            work%w1(l) = merge(merge(w1, w3, form > 0.0_wp), work%w1(l), work%long(l) > 0.0_wp)
            work%w2(l) = merge(w2, work%w2(l), work%long(l) > 0.0_wp)
            work%w3(l) = merge(merge(w3, w1, form > 0.0_wp), work%w3(l), work%long(l) > 0.0_wp)
        end do
    end subroutine long_steps

    !> The angles of the lanes whose triple was doubled at least n times: y, z before, s/z, c/z, d/z after.
    pure subroutine double_angles(n, doublings, nu, bg, old_y, old_z, s, c, d, z, ec, es)
        real(wp), intent(in) :: n, doublings(lanes)
        real(wp), intent(in) :: nu(lanes), bg(lanes), old_y(lanes), old_z(lanes)
        real(wp), intent(in) :: s(lanes), c(lanes), d(lanes), z(lanes)
        real(wp), intent(inout) :: ec(lanes), es(lanes)
        real(wp) :: new_ec, new_es
        integer :: l

        do l = 1, lanes
            new_ec = ec(l)
            new_es = es(l)
            call double_angle(nu(l), bg(l), old_y(l), old_z(l), s(l), c(l)*d(l), z(l), new_ec, new_es)
            ec(l) = merge(new_ec, ec(l), doublings(l) >= n)
            es(l) = merge(new_es, es(l), doublings(l) >= n)
        end do
    end subroutine double_angles

    !> Numerators over a denominator that has become small, and with them the angle, of order one again.
    pure subroutine form_anew(s, c, d, z, ec, es)
        real(wp), intent(inout) :: s(lanes), c(lanes), d(lanes), z(lanes), ec(lanes), es(lanes)
        real(wp) :: n
        integer :: l

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
    end subroutine form_anew

    !> How often the time of each long lane must be halved for pmax f^2 to come down to `limit`, f the part of
    !> the time that is left.
    pure subroutine count_halvings(limit, pmax, long, f, halvings, most)
        real(wp), intent(in) :: limit
        real(wp), intent(in) :: pmax(lanes), long(lanes)
        real(wp), intent(inout) :: f(lanes)
        real(wp), intent(out) :: halvings(lanes)
        integer, intent(out) :: most
        real(wp) :: n
        integer :: over, l

        halvings = 0.0_wp
        most = 0
        do
            over = 0
            do l = 1, lanes
                n = pmax(l)*f(l)*f(l)
                n = merge(1.0_wp, 0.0_wp, long(l) > 0.0_wp .and. n > limit)
                halvings(l) = halvings(l) + n
                f(l) = f(l)*(1 - 0.5_wp*n)
                over = over + merge(1, 0, n > 0.0_wp)
            end do
            if (over == 0) exit
            most = most + 1
        end do
    end subroutine count_halvings

    !> A turn of any size from its four components, known up to a factor: divided by their norm, less 1.
    pure subroutine unit_turn(e0, w0, w1, w2, w3)
        real(wp), intent(in) :: e0
        real(wp), intent(out) :: w0
        real(wp), intent(inout) :: w1, w2, w3
        real(wp) :: inverse

        inverse = 1/sqrt(e0*e0 + (w1*w1 + w2*w2 + w3*w3))
        w0 = e0*inverse - 1
        w1 = w1*inverse
        w2 = w2*inverse
        w3 = w3*inverse
    end subroutine unit_turn

    include 'middle_formulas.inc'

    include 'long_formulas.inc'

    include 'turn_formulas.inc'

end module frb_flow_block_long
