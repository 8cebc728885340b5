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
    use frb_flow_limits, only: short_limit, middle_limit, plain_smallest
    use frb_kinds, only: wp
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: lanes, vector, lane_bodies, workspace, step_cyclic, is_served

    integer, parameter :: lanes = 64    !! bodies in a block
    integer, parameter :: vector = 8    !! blocks are filled to whole vectors: no loop ends with a part

    !> How far a step reaches: max(p, r) and, in the same unit, the square of the half angle.
    real(wp), parameter :: angle_as_reach = 0.16_wp
    integer, parameter :: classes = 3           !! tiny, short and middle steps
    real(wp), parameter :: limits(0:classes) = [-1.0_wp, 8.0e-5_wp, short_limit, 26*middle_limit]

    real(wp), parameter :: smallest_square = plain_smallest**2, no_reach = 1.0e300_wp   !! goes one by one

    !> Constants of the bodies of a block in cyclic axes, the middle moment second, times t = h/2.
    type :: lane_bodies
        real(wp) :: a(lanes), b(lanes), g(lanes)        !! alpha t, beta t, gamma t
        real(wp) :: ag(lanes), ab(lanes), bg(lanes)     !! their products
        real(wp) :: first(lanes), last(lanes)           !! a1 t, a3 t
        real(wp) :: rate(lanes), base(lanes)            !! the larger and the smaller of them
        real(wp) :: above(lanes, 3)                     !! a1 t, a2 t, a3 t less base
        real(wp) :: rho(14)                             !! of equal bodies: polynomial_of_rho
        logical :: alike                                !! the bodies are equal: the polynomial holds
    end type lane_bodies

    !> Numbers that one loop computes and another one uses.
    type :: workspace
        real(wp) :: p(lanes), r(lanes), reach(lanes)
        real(wp) :: y(lanes), part(lanes)                           !! s^2; part of t where its series begins
        real(wp) :: scd(lanes), d0(lanes)                           !! s c d, c d D0
        real(wp) :: n1(lanes), n2(lanes), n3(lanes)                 !! L times d0
        real(wp) :: gg(lanes), form(lanes), rr(lanes), nu(lanes)    !! |m|^2; 1 or, in the mirror form, -1; R'
        real(wp) :: tn(lanes), td(lanes)                            !! tau = tn/td
        real(wp) :: d(lanes, 3)                                     !! increments of the momentum
        real(wp) :: w0(lanes), w(lanes, 3)                          !! the turn less 1
    end type workspace

contains

    !> The step of n lanes with momenta (x1, x2, x3) in cyclic axes, plain numbers: increments, and
    !> the turn if with_attitude. Lanes that are not served, see is_served, have none.
    pure subroutine step_cyclic(n, with_attitude, of, x1, x2, x3, work, all_served)
        integer, intent(in) :: n
        logical, intent(in) :: with_attitude
        type(lane_bodies), intent(in) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        logical, intent(out) :: all_served
        integer(int64) :: many(0:classes)
        integer :: class

        call measure(n, of, x1, x2, x3, work, many(1:))
        many(0) = 0
        if (.not. of%alike) many(1) = 0
        all_served = many(classes) == n
        do class = 1, classes
            if (many(class) - many(class - 1) == n) then
                call step_class(class, n, with_attitude, of, x1, x2, x3, work)
                return
            end if
        end do
        call step_mixed(n, with_attitude, of, x1, x2, x3, work)
    end subroutine step_cyclic

    !> Constants of the motion, and the number of lanes whose reach is within each class.
    pure subroutine measure(n, of, x1, x2, x3, work, many)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        integer(int64), intent(out) :: many(classes)
        real(wp) :: s1, s2, s3, gg, k, p, r, reach
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
            reach = max(p, r, angle_as_reach*(of%rate(l)*(of%rate(l)*gg)))
            reach = merge(no_reach, reach, gg <= smallest_square)
            work%p(l) = p
            work%r(l) = r
            work%reach(l) = reach
            tiny = tiny + merge(1_int64, 0_int64, reach <= limits(1))
            short = short + merge(1_int64, 0_int64, reach <= limits(2))
            middle = middle + merge(1_int64, 0_int64, reach <= limits(3))
        end do
        many = [tiny, short, middle]
    end subroutine measure

    !> Lanes of several classes: one class after another, while the other lanes stand still.
    pure subroutine step_mixed(n, with_attitude, of, x1, x2, x3, work)
        integer, intent(in) :: n
        logical, intent(in) :: with_attitude
        type(lane_bodies), intent(in) :: of
        real(wp), intent(in) :: x1(n), x2(n), x3(n)
        type(workspace), intent(inout) :: work
        type(workspace) :: some
        real(wp) :: m1(lanes), m2(lanes), m3(lanes)
        logical :: mine(lanes)
        integer :: class, l

        work%d = 0.0_wp
        work%w0 = 0.0_wp
        work%w = 0.0_wp
        do class = 1, classes
            if (class == 1 .and. .not. of%alike) cycle
            mine(:n) = work%reach(:n) <= limits(class)
            if (class > merge(1, 2, of%alike)) mine(:n) = mine(:n) .and. work%reach(:n) > limits(class - 1)
            if (.not. any(mine(:n))) cycle
            m1(:n) = merge(x1, 0.0_wp, mine(:n))
            m2(:n) = merge(x2, 0.0_wp, mine(:n))
            m3(:n) = merge(x3, 0.0_wp, mine(:n))
            some%p(:n) = merge(work%p(:n), 0.0_wp, mine(:n))
            some%r(:n) = merge(work%r(:n), 0.0_wp, mine(:n))
            some%reach(:n) = merge(work%reach(:n), 0.0_wp, mine(:n))
            call step_class(class, n, with_attitude, of, m1, m2, m3, some)
            do l = 1, n
                if (.not. mine(l)) cycle
                work%d(l, :) = some%d(l, :)
                if (.not. with_attitude) cycle
                work%w0(l) = some%w0(l)
                work%w(l, :) = some%w(l, :)
            end do
        end do
    end subroutine step_mixed

    !> Whether step_lanes has advanced a lane.
    elemental function is_served(reach) result(served)
        real(wp), intent(in) :: reach
        logical :: served

        served = reach <= limits(classes)
    end function is_served

    !> Lanes of one class, p, r and reach known: their increments and turns.
    pure subroutine step_class(class, n, with_attitude, of, x1, x2, x3, work)
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
            farthest = maxval(work%reach(:n))
            do l = 1, n
                part = merge(0.25_wp, 0.125_wp, work%reach(l) <= 16*middle_limit)
                part = merge(0.5_wp, part, work%reach(l) <= 4*middle_limit)
                part = merge(1.0_wp, part, work%reach(l) <= middle_limit)
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
        if (with_attitude) then
            call move_and_keep(n, of, x1, x2, x3, work)
            call turn_lanes(n, of, work)
        else
            call move(n, of, x1, x2, x3, work)
        end if
    end subroutine step_class

    !> Increments of the momentum. `keep`: also stores the numbers that the turn needs.
    pure subroutine move(n, of, x1, x2, x3, work)
        logical, parameter :: keep = .false.
        include 'lane_momentum.inc'
    end subroutine move

    !> The same; what the attitude needs is kept.
    pure subroutine move_and_keep(n, of, x1, x2, x3, work)
        logical, parameter :: keep = .true.
        include 'lane_momentum.inc'
    end subroutine move_and_keep

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

    !> As short_angles, for middle steps.
    pure subroutine middle_angles(n, of, work)
        integer, intent(in) :: n
        type(lane_bodies), intent(in) :: of
        type(workspace), intent(inout) :: work
        real(wp) :: y, nu, angle, xx
        integer :: l

        do l = 1, n
            y = work%y(l)
            nu = work%nu(l)*y
            angle = work%part(l)*merge(of%first(l), of%last(l), work%form(l) > 0) - work%form(l)*of%b(l) &
                    *(nu*(sqrt(y)*middle_third_kind(work%p(l)*y, work%r(l)*y, nu)))
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

    !> The turn (X0, V) up to its norm, then divided by it, less 1.
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
            x0 = x0*work%d0(l)
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

    include 'short_third_kind.inc'

    include 'middle_formulas.inc'

    include 'middle_third_kind.inc'

end module frb_flow_lanes
