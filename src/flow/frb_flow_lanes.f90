!> One step of a block of bodies, one per SIMD lane, in a form that needs no sine, quadrant or period. With
!> t = h/2, s, c, d the elliptic triple at t and a, b, g, p, r as in short_formulas.inc:
!>
!> L = s m(t), the momentum at mid-step, comes by the addition theorem. The theorem from there, forward and
!> back, gives m(h) - m(0) = f (-a L2 L3, b L3 L1, -g L1 L2) and m(0) + m(h) = f L, f = 2 c d/(s D),
!> D = 1 - a g L2^2. The turn q(0)^-1 q(h), (1, Y)/sqrt(1 + |Y|^2), carries m(h) to m(0): so
!> Y x (m(0) + m(h)) = m(0) - m(h), and Y_i = (a_i t + rho) L_i. The last unknown, rho, belongs to the angle
!> about m, so it is a constant of the motion; it follows from e z of frb_flow_one, at a phase where z is
!> simple, with H the integral of the third kind, R = g m2^2 + b m3^2, nu = g R, tau = tan(|m| (a1 t - b nu
!> H))/|m|:
!>     a1 t + rho = tau (1 + nu s^2) c/(s (d + tau s c R))
!> or, axes 1 and 3 and c and d exchanged, with R = -(a m2^2 + b m1^2), nu = -a R and
!> tau = tan(|m| (a3 t + b nu H))/|m|.
!> The loops keep (X0, V), the turn up to its norm, V = X0 Y: so no division waits for another.
!>
!> The shortest steps of equal bodies use series only. rho is symmetric in a1, a2, a3, so a polynomial in
!> u = (a t |m|)^2 and e = a t (a1 t m1^2 + a2 t m2^2 + a3 t m3^2), a the largest of them:
!> rho/(a t) = (s2 e - 2 s3 u)/3 + ..., s1, s2, s3 the symmetric functions of a1/a, a2/a, a3/a: no form, no
!> angle, no root. For different bodies it would take longer to form the coefficients than the series save.
!>
!> The loops are short, so that a processor has several vectors in work; each formula is called once in this
!> module: GCC inlines only such private copies (a formula of another module took 2 to 4 times longer).
module frb_flow_lanes
    use frb_flow_limits, only: short_limit, middle_limit, period_limit, plain_smallest
    use frb_kinds, only: wp
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: lanes, vector, classes, limits, angle_as_size, lane_bodies, workspace, measure, step_lanes

    integer, parameter :: lanes = 64    !! bodies in a block
    !> Blocks are filled to whole vectors: compilers may round otherwise in what is left of a loop.
    integer, parameter :: vector = 8

    !> Size of a step: max(p, r) and, in the same unit, the square of the half angle.
    real(wp), parameter :: angle_as_size = 0.16_wp
    !> Tiny, short and middle steps, and those of frb_flow_lanes_long, by the largest size of each.
    integer, parameter :: classes = 4
    real(wp), parameter :: limits(0:classes) = [-1.0_wp, 1.6e-4_wp, short_limit, 26*middle_limit, &
                                                period_limit]

    real(wp), parameter :: smallest_square = plain_smallest**2, no_lane = 1.0e300_wp    !! goes one by one

    !> Constants of the bodies of a block in cyclic axes, the middle moment second, times t = h/2.
    type :: lane_bodies
        real(wp) :: a(lanes), b(lanes), g(lanes)        !! alpha t, beta t, gamma t
        real(wp) :: ag(lanes), ab(lanes), bg(lanes)     !! their products
        real(wp) :: first(lanes), last(lanes)           !! a1 t, a3 t
        real(wp) :: rate(lanes)                         !! the larger of them
        logical :: alike                                !! the bodies are equal, all with these:
        real(wp) :: inverse(3)                          !! a1, a2, a3 in descending order
        logical :: odd                                  !! a3 t comes first
        integer :: full                                 !! number of lanes
        logical :: rho_known                            !! the rest, for tiny steps, is set
        real(wp) :: base(lanes), above(lanes, 3)        !! the smaller of a1 t, a3 t; a1 t, a2 t, a3 t less it
        real(wp) :: rho(14)                             !! polynomial_of_rho
    end type lane_bodies

    !> Numbers that one loop computes and another one uses.
    type :: workspace
        real(wp) :: p(lanes), r(lanes), size(lanes)
        real(wp) :: y(lanes), part(lanes)                           !! s^2; part of t where its series begins
        real(wp) :: scd(lanes), d0(lanes)                           !! s c d, c d D0
        real(wp) :: n1(lanes), n2(lanes), n3(lanes)                 !! L times d0
        real(wp) :: gg(lanes), form(lanes), rr(lanes), nu(lanes)    !! |m|^2; 1 or, in the mirror form, -1; R'
        real(wp) :: tn(lanes), td(lanes)                            !! tau = tn/td
        real(wp) :: d(lanes, 3)                                     !! increments of the momentum
        real(wp) :: w0(lanes), w(lanes, 3)                          !! the turn less 1
    end type workspace

contains

    !> Constants of the motion and sizes of the steps of n lanes with momenta (x1, x2, x3) in cyclic axes,
    !> plain numbers; the number of lanes within the limit of each class.
    pure subroutine measure(n, of, x1, x2, x3, work, many)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        integer, intent(out) :: many(0:classes)
        real(wp) :: s1, s2, s3, gg, k, p, r, step
        integer(int64) :: tiny, short, middle
        integer :: l

        tiny = 0
        short = 0
        middle = 0
        do l = 1, n
            s1 = x1(l)*x1(l)
            s2 = x2(l)*x2(l)
            s3 = x3(l)*x3(l)
            k = of%ag(l)*s2
            p = of%bg(l)*s1 + k
            r = of%ab(l)*s3 + k
            gg = s1 + (s2 + s3)
            step = max(p, r, angle_as_size*(of%rate(l)*(of%rate(l)*gg)))
            step = merge(no_lane, step, gg <= smallest_square)
            work%p(l) = p
            work%r(l) = r
            work%size(l) = step
            tiny = tiny + merge(1_int64, 0_int64, step <= limits(1))
            short = short + merge(1_int64, 0_int64, step <= limits(2))
            middle = middle + merge(1_int64, 0_int64, step <= limits(3))
        end do
        ! The polynomial of the tiny steps is that of equal bodies.
        many = [0, merge(int(tiny), 0, of%alike), int(short), int(middle), int(middle)]
        if (middle < n) many(classes) = count(work%size(:n) <= limits(classes))
    end subroutine measure

    !> The step of lanes of one class but the last, measured: increments and, with_attitude, turns.
    pure subroutine step_lanes(class, n, with_attitude, of, x1, x2, x3, work)
        integer, intent(in) :: class, n
        logical, intent(in) :: with_attitude
        type(lane_bodies), intent(in) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        real(wp), parameter :: parts(3) = [0.125_wp, 0.25_wp, 0.5_wp]
        real(wp) :: scd, farthest, part
        integer :: i, l

        if (class == 1) then
            call tiny_momenta(n, of, x1, x2, x3, work)
            if (with_attitude) call tiny_turns(n, of, x1, x2, x3, work)
            return
        end if
        farthest = 0.0_wp
        select case (class)
        case (2)
            do l = 1, n
                call short_series(work%p(l) + work%r(l), work%p(l)*work%r(l), work%y(l), scd)
            end do
        case default
            farthest = maxval(work%size(:n), work%size(:n) <= limits(class))
            do l = 1, n
                part = merge(0.25_wp, 0.125_wp, work%size(l) <= 16*middle_limit)
                part = merge(0.5_wp, part, work%size(l) <= 4*middle_limit)
                part = merge(1.0_wp, part, work%size(l) <= middle_limit)
                work%part(l) = part
                part = part*part
                call middle_series((work%p(l) + work%r(l))*part, work%p(l)*work%r(l)*(part*part), &
                                   work%y(l), scd)
                work%y(l) = part*work%y(l)
            end do
        end select
        if (with_attitude) then
            call choose_forms(n, of, x1, x2, x3, work)
            if (class == 2) then
                call short_angles(n, of, work)
            else
                call middle_angles(n, of, work)
            end if
        end if
        do i = 1, size(parts)
            if (farthest <= middle_limit/(4*parts(i)**2)) cycle
            if (with_attitude) call double_lane_angles(n, parts(i), of, work)
            call double_lanes(n, parts(i), work)
        end do
        call move(n, of, x1, x2, x3, work)
        if (with_attitude) call turn_lanes(n, of, work)
    end subroutine step_lanes

    !> Increments of the momentum, and the numbers that the turn needs: without them the momentum alone
    !> takes as long.
    pure subroutine move(n, of, x1, x2, x3, work)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        real(wp) :: m1, m2, m3, y, cu, cw, cc, yc, scd, u, n1, n2, n3, d0, f
        integer :: l

        do l = 1, n
            m1 = x1(l)
            m2 = x2(l)
            m3 = x3(l)
            y = work%y(l)
            cu = 1 - work%p(l)*y
            cw = 1 - work%r(l)*y
            cc = cu*cw
            yc = y*cc
            scd = sqrt(yc)
            u = yc*m3
            n1 = m1*(scd*cw) - (of%a(l)*m2)*u
            n2 = m2*(scd*cc) + (of%b(l)*m1)*u
            n3 = m3*(scd*cu) - (of%g(l)*m1)*(yc*m2)
            d0 = cc - (of%ag(l)*(m2*m2))*yc
            f = (cc + cc)/(scd*(d0*d0 - of%ag(l)*(n2*n2)))
            u = f*n3
            work%d(l, 1) = -(of%a(l)*n2)*u
            work%d(l, 2) = (of%b(l)*n1)*u
            work%d(l, 3) = -(of%g(l)*n1)*(f*n2)
            work%n1(l) = n1
            work%n2(l) = n2
            work%n3(l) = n3
            work%d0(l) = d0
            work%scd(l) = scd
        end do
    end subroutine move

    !> Of the two mirror forms the one with the smaller nu: with b = a + g, nu <= nu' is
    !> b g (m2^2 + m3^2) <= b a (m1^2 + m2^2).
    pure subroutine choose_forms(n, of, x1, x2, x3, work)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        real(wp) :: s1, s2, s3, u, rr, first, mirror
        integer :: l

        do l = 1, n
            s1 = x1(l)*x1(l)
            s2 = x2(l)*x2(l)
            s3 = x3(l)*x3(l)
            first = of%bg(l)*(s2 + s3)
            mirror = of%ab(l)*(s1 + s2)
            u = merge(of%g(l), of%a(l), first <= mirror)
            rr = u*s2 + of%b(l)*merge(s3, s1, first <= mirror)
            work%gg(l) = s1 + (s2 + s3)
            work%form(l) = merge(1.0_wp, -1.0_wp, first <= mirror)
            work%nu(l) = u*rr
            work%rr(l) = merge(rr, -rr, first <= mirror)
        end do
    end subroutine choose_forms

    !> tau = tn/td for the angle t (a1 - beta nu H) or its mirror image: convergents of the continued
    !> fraction of tan, as many as the square of the angle needs.
    pure subroutine short_angles(n, of, work)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        type(workspace), intent(inout) :: work
        real(wp) :: p, r, angle, xx
        integer :: l

        do l = 1, n
            p = work%p(l)
            r = work%r(l)
            angle = merge(of%first(l), of%last(l), work%form(l) > 0) &
                    - work%form(l)*of%b(l)*(work%nu(l)*short_third_kind(p + r, p*r, work%nu(l)))
            xx = angle*(angle*work%gg(l))
            work%tn(l) = angle*(1 - xx*(4/33.0_wp - xx*(1/495.0_wp)))
            work%td(l) = 1 - xx*(5/11.0_wp - xx*(2/99.0_wp - xx*(1/10395.0_wp)))
        end do
    end subroutine short_angles

    !> As short_angles, for middle steps. In two loops, each so short that several vectors are in work.
    pure subroutine middle_angles(n, of, work)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        type(workspace), intent(inout) :: work
        real(wp) :: y, nu, angle, xx
        integer :: l

        do l = 1, n
            y = work%y(l)
            nu = work%nu(l)*y
            work%tn(l) = work%part(l)*merge(of%first(l), of%last(l), work%form(l) > 0) &
                         - work%form(l)*of%b(l)*(nu*(sqrt(y)*middle_third_kind(work%p(l)*y, work%r(l)*y, nu)))
        end do
        do l = 1, n
            angle = work%tn(l)
            xx = angle*(angle*work%gg(l))
            work%tn(l) = angle*(1 - xx*(7/51.0_wp - xx*(1/255.0_wp - xx*(2/69615.0_wp &
                         - xx*(1/34459425.0_wp)))))
            work%td(l) = 1 - xx*(8/17.0_wp - xx*(7/255.0_wp - xx*(4/9945.0_wp - xx*(1/765765.0_wp))))
        end do
    end subroutine middle_angles

    !> Doubles the time of s^2 in the lanes that are at `part` of t.
    pure subroutine double_lanes(n, part, work)
        integer, intent(in) :: n
        real(wp), intent(in) :: part
        type(workspace), intent(inout) :: work
        real(wp) :: y, u, w, rec
        integer :: l

        do l = 1, n
            y = work%y(l)
            u = work%p(l)*y
            w = work%r(l)*y
            rec = 2/(1 - u*w)
            work%y(l) = merge((y*((1 - u)*(1 - w)))*(rec*rec), y, work%part(l) <= part)
        end do
    end subroutine double_lanes

    !> Doubles the time of the angle, as (td, tn |m|) up to a factor, before that of s^2: see double_angle.
    pure subroutine double_lane_angles(n, part, of, work)
        integer, intent(in) :: n
        real(wp), intent(in) :: part
        type(lane_bodies), intent(in) :: of
        type(workspace), intent(inout) :: work
        real(wp) :: y, y2, u, w, uw, rec, cd2, along, across, tn, td, c2, s2
        integer :: l

        do l = 1, n
            y = work%y(l)
            tn = work%tn(l)
            td = work%td(l)
            u = work%p(l)*y
            w = work%r(l)*y
            uw = u*w
            rec = 2/(1 - uw)
            y2 = (y*((1 - u)*(1 - w)))*(rec*rec)
            cd2 = ((1 + uw) - (u + u))*(((1 + uw) - (w + w))*(rec*(0.25_wp*rec)))
            along = 1 + work%nu(l)*(y2 - y*cd2)
            across = (work%form(l)*of%b(l))*(work%nu(l)*y)*sqrt(y2)
            c2 = td*td - work%gg(l)*(tn*tn)
            s2 = 2*(td*tn)
            work%td(l) = merge(c2*along + work%gg(l)*s2*across, td, work%part(l) <= part)
            work%tn(l) = merge(s2*along - c2*across, tn, work%part(l) <= part)
        end do
    end subroutine double_lane_angles

    !> The turn (X0, V) up to its norm, then divided by it, less 1. In two short loops.
    pure subroutine turn_lanes(n, of, work)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        type(workspace), intent(inout) :: work
        real(wp) :: y, tn, x0, f, u, g, a, v1, v2, v3, square, norm, inverse
        integer :: l

        do l = 1, n
            y = work%y(l)
            tn = work%tn(l)
            g = of%g(l)
            a = of%a(l)
            u = 1 - merge(work%r(l), work%p(l), work%form(l) > 0)*y
            x0 = y*(work%td(l)*u + tn*(work%rr(l)*work%scd(l)))
            f = (tn*(1 + work%nu(l)*y))*work%scd(l)
            u = of%b(l)*x0
            v1 = (f + merge(0.0_wp, u, work%form(l) > 0))*work%n1(l)
            v2 = (f + merge(-g, a, work%form(l) > 0)*x0)*work%n2(l)
            v3 = (f - merge(u, 0.0_wp, work%form(l) > 0))*work%n3(l)
            work%w0(l) = x0*work%d0(l)
            work%w(l, 1) = v1
            work%w(l, 2) = v2
            work%w(l, 3) = v3
        end do
        do l = 1, n
            x0 = work%w0(l)
            v1 = work%w(l, 1)
            v2 = work%w(l, 2)
            v3 = work%w(l, 3)
            square = v1*v1 + (v2*v2 + v3*v3)
            norm = sqrt(x0*x0 + square)
            u = norm + abs(x0)
            inverse = 1/(norm*u)
            u = u*inverse
            work%w0(l) = merge(-square*inverse, x0*u - 1, x0 > 0)
            work%w(l, 1) = v1*u
            work%w(l, 2) = v2*u
            work%w(l, 3) = v3*u
        end do
    end subroutine turn_lanes

    include 'lane_tiny.inc'

    include 'series_formulas.inc'

    include 'short_coefficients.inc'

    include 'short_third_kind.inc'

    include 'middle_formulas.inc'

    include 'middle_coefficients.inc'

    include 'middle_third_kind.inc'

end module frb_flow_lanes
