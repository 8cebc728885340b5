!> Steps of a block of bodies that the series reach, one body per SIMD lane, at any angle about m: the
!> formulas of frb_flow_tangent_one.
module frb_flow_tangent_near
    use frb_flow_limits, only: tiny_limit, short_limit, middle_limit, sin_cos_limit
    use frb_flow_tangent_lanes, only: lanes, lane_orbits, lane_ends, angle_as_reach
    use frb_kinds, only: wp
    implicit none
    private

    public :: find_near_ends

    !> Numbers that one loop computes and another one uses.
    type :: series_lanes
        real(wp) :: v0(lanes), v2(lanes), v3(lanes), size(lanes), change(lanes), twice(lanes)
        real(wp) :: over_w(lanes), over_gg(lanes)                   !! 1/(1 + nu s^2), 1/|m|^2
        ! One array for each series, so that none is overwritten: compilers make slow code of a store that
        ! depends on its lane.
        real(wp), dimension(lanes, 3) :: y, scd, dd, aa, bb, third  !! s^2, s c d; D, A, B, H
        real(wp), dimension(lanes, 3) :: along, cosm1               !! e is (1 + cosm1, along m)
    end type series_lanes

contains

    !> Computes the parts that finish_lanes combines, for the lanes of `of`; b: beta t of the body.
    pure subroutine find_near_ends(b, of, ends)
        real(wp), intent(in) :: b
        type(lane_orbits), intent(in) :: of
        type(lane_ends), intent(inout) :: ends
        type(series_lanes) :: it
        integer :: level        ! the series that holds

        call tiny_parts(of, it)
        level = 1
        if (.not. of%all_tiny) then
            call short_parts(of, it)
            level = 2
        end if
        call small_angles(b, level, of, it)
        if (.not. of%all_short) then
            call middle_parts(b, of, it)
            level = 3     ! not all short, so not all tiny: the others are of level 2
        end if
        call find_momenta(b, level, of, it, ends)
        call find_turns(level, of, it, ends)
        call find_columns(b, level, of, it, ends)
        call find_covectors(b, level, of, it, ends)
    end subroutine find_near_ends

    !> The triple and the integrals by the first terms of their series.
    pure subroutine tiny_parts(of, it)
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: p, r
        integer :: l

        do l = 1, lanes
            p = of%p(l)
            r = of%r(l)
            call tiny_series(p + r, p*r, it%y(l, 1), it%scd(l, 1))
            call tiny_integrals(p + r, p*r, p, r, it%dd(l, 1), it%aa(l, 1), it%bb(l, 1))
            it%third(l, 1) = tiny_third_kind(p + r, p*r, of%nu(l))
        end do
    end subroutine tiny_parts

    !> The triple and the integrals with all terms of short steps, for lanes that need more than the first
    !> terms.
    pure subroutine short_parts(of, it)
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: p, r, y, scd, dd, aa, bb, third
        integer :: l

        do l = 1, lanes
            p = of%p(l)
            r = of%r(l)
            call short_series(p + r, p*r, y, scd)
            call short_integrals(p + r, p*r, p, r, dd, aa, bb)
            third = short_third_kind(p + r, p*r, of%nu(l))
            it%y(l, 2) = merge(y, it%y(l, 1), of%reach(l) > tiny_limit)
            it%scd(l, 2) = merge(scd, it%scd(l, 1), of%reach(l) > tiny_limit)
            it%dd(l, 2) = merge(dd, it%dd(l, 1), of%reach(l) > tiny_limit)
            it%aa(l, 2) = merge(aa, it%aa(l, 1), of%reach(l) > tiny_limit)
            it%bb(l, 2) = merge(bb, it%bb(l, 1), of%reach(l) > tiny_limit)
            it%third(l, 2) = merge(third, it%third(l, 1), of%reach(l) > tiny_limit)
        end do
    end subroutine short_parts

    !> The turn e of small angles.
    pure subroutine small_angles(b, k, of, it)
        real(wp), intent(in) :: b
        integer, intent(in) :: k        !! the level
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: angle, along
        integer :: l

        do l = 1, lanes
            angle = of%rate(l) - b*of%nu(l)*it%third(l, k)
            call small_turn(angle*angle*of%gg(l), along, it%cosm1(l, k))
            it%along(l, k) = angle*along
        end do
    end subroutine small_angles

    !> Triple, integrals and turn of the lanes beyond, at any angle.
    pure subroutine middle_parts(b, of, it)
        real(wp), intent(in) :: b
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        real(wp) :: p, r, y, scd, dd, aa, bb, angle, s3, norm, sine, half, sine_half, beyond
        integer :: l

        do l = 1, lanes
            beyond = max(of%reach(l), of%square(l)*angle_as_reach)
            p = min(of%p(l), middle_limit)
            r = min(of%r(l), middle_limit)
            call middle_series(p + r, p*r, y, scd)
            s3 = y*sqrt(y)
            call middle_integrals(p*y, r*y, dd, aa, bb)
            angle = of%rate(l) - b*of%nu(l)*(s3*middle_third_kind(p*y, r*y, of%nu(l)*y))
            ! 1 - cos x = 2 sin(x/2)^2 keeps its digits at small angles.
            norm = sqrt(of%gg(l))
            half = max(-sin_cos_limit, min(sin_cos_limit, 0.5_wp*angle*norm))
            call sin_cos(half, sine_half, sine)
            sine = 2*sine_half*sine
            it%y(l, 3) = merge(y, it%y(l, 2), beyond > short_limit)
            it%scd(l, 3) = merge(scd, it%scd(l, 2), beyond > short_limit)
            it%dd(l, 3) = merge(s3*dd, it%dd(l, 2), beyond > short_limit)
            it%aa(l, 3) = merge(s3*aa, it%aa(l, 2), beyond > short_limit)
            it%bb(l, 3) = merge(s3*bb, it%bb(l, 2), beyond > short_limit)
            it%along(l, 3) = merge(sine/norm, it%along(l, 2), beyond > short_limit)
            it%cosm1(l, 3) = merge(-2*sine_half*sine_half, it%cosm1(l, 2), beyond > short_limit)
        end do
    end subroutine middle_parts

    !> Momentum at the end, and the direction (1 + v0, 0, v2, v3) of z.
    pure subroutine find_momenta(b, k, of, it, ends)
        real(wp), intent(in) :: b
        integer, intent(in) :: k        !! the level
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        type(lane_ends), intent(inout) :: ends
        real(wp) :: a, g, m1, m2, m3, y, scd, ag, d1, d2, d3, v0, v2, v3
        integer :: l

        do l = 1, lanes
            a = of%a(l)
            g = of%g(l)
            m1 = of%m1(l)
            m2 = of%m2(l)
            m3 = of%m3(l)
            ag = a*g*(m2*m2)
            y = it%y(l, k)
            scd = it%scd(l, k)
            call short_momentum(of%p(l)*y, of%r(l)*y, ag*(scd*scd), scd, m1, m2, m3, a*(m2*m3), b*(m3*m1), &
                                g*(m1*m2), d1, d2, d3)
            call short_direction(b, g, of%r(l)*y, ag*y, y, scd, m2, m3, b*(m3*m1), g*(m1*m2), v0, v2, v3)
            ends%e1(l) = m1 + d1
            ends%e2(l) = m2 + d2
            ends%e3(l) = m3 + d3
            it%v0(l) = v0
            it%v2(l) = v2
            it%v3(l) = v3
            it%size(l) = (v0*(2 + v0) + v2*v2) + v3*v3
        end do
        do l = 1, lanes
            it%change(l) = short_norm(it%size(l))
        end do
        if (of%all_short) return
        do l = 1, lanes
            d1 = it%size(l)
            d2 = sqrt(1 + d1)
            it%size(l) = merge(-d1/(d2*(1 + d2)), it%change(l), of%reach(l) > short_limit)
        end do
        it%change = it%size
    end subroutine find_momenta

    !> The turn e z, less 1, and 2/|z|^2 for z ~ (1, 0, -x, -yy).
    pure subroutine find_turns(k, of, it, ends)
        integer, intent(in) :: k        !! the level
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        type(lane_ends), intent(inout) :: ends
        real(wp) :: v2, v3, w0, w1, w2, w3, z0
        integer :: l

        do l = 1, lanes
            v2 = it%v2(l)
            v3 = it%v3(l)
            call join_turns(1 + it%cosm1(l, k), it%along(l, k), of%m1(l), of%m2(l), of%m3(l), 1 + it%v0(l), &
                            v2, v3, w1, w2, w3)
            call small_unit_turn(it%cosm1(l, k), it%v0(l), it%along(l, k)*(of%m2(l)*v2 + of%m3(l)*v3), &
                                 it%change(l), w0, w1, w2, w3)
            ends%w0(l) = w0
            ends%w1(l) = w1
            ends%w2(l) = w2
            ends%w3(l) = w3
            z0 = (1 + it%v0(l))*(1 + it%change(l))
            it%twice(l) = 2*(z0*z0)
        end do
    end subroutine find_turns

    !> R^T - 1, the columns of K. The time is not shifted.
    pure subroutine find_columns(b, k, of, it, ends)
        real(wp), intent(in) :: b
        integer, intent(in) :: k        !! the level
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(inout) :: it
        type(lane_ends), intent(inout) :: ends
        real(wp) :: x, yy, x1, x2, x3, y1, y2, y3, twice
        integer :: l

        do l = 1, lanes
            call short_gradients(of%a(l), b, of%g(l), of%m1(l), of%m2(l), of%m3(l), of%gg(l), of%p(l), &
                                 of%r(l), of%nu(l), it%y(l, k), it%scd(l, k), it%aa(l, k), it%bb(l, k), x, &
                                 yy, x1, x2, x3, y1, y2, y3, it%over_w(l), it%over_gg(l))
            twice = it%twice(l)
            ends%x(l) = x
            ends%yy(l) = yy
            ends%x1(l) = twice*x1
            ends%x2(l) = twice*x2
            ends%x3(l) = twice*x3
            ends%y1(l) = twice*y1
            ends%y2(l) = twice*y2
            ends%y3(l) = twice*y3
            call turn_matrix(1.0_wp, x, yy, twice, ends%r11(l), ends%r12(l), ends%r13(l), ends%r22(l), &
                             ends%r23(l), ends%r33(l))
            ends%d(l) = 1.0_wp
            ends%t1(l) = 0.0_wp
            ends%t2(l) = 0.0_wp
            ends%t3(l) = 0.0_wp
        end do
    end subroutine find_columns

    !> The covector k m + g of W, and sine and cosine of the turn about m as W needs them.
    pure subroutine find_covectors(b, k, of, it, ends)
        real(wp), intent(in) :: b
        integer, intent(in) :: k        !! the level
        type(lane_orbits), intent(in) :: of
        type(series_lanes), intent(in) :: it
        type(lane_ends), intent(inout) :: ends
        real(wp) :: y, along, psi, angle
        integer :: l

        do l = 1, lanes
            y = it%y(l, k)
            along = it%along(l, k)
            psi = -2*(b*of%g(l))*((it%dd(l, k) + (1 - of%r(l)*y)*it%bb(l, k))*it%over_w(l))
            angle = 2*((of%rate(l) - along*(1 + it%cosm1(l, k))) &
                       - (b*of%nu(l))*((1 - of%p(l)*y)*it%aa(l, k)*it%over_w(l)))*it%over_gg(l)
            ends%f1(l) = angle*of%m1(l)
            ends%f2(l) = (angle + psi*of%g(l))*of%m2(l)
            ends%f3(l) = (angle + psi*b)*of%m3(l)
            ends%sine(l) = 2*along*(1 + it%cosm1(l, k))
            ends%versine(l) = 2*along*along
        end do
    end subroutine find_covectors

    include 'all_series.inc'

    include 'angle_formulas.inc'

    include 'tangent_turn_formulas.inc'

    include 'tangent_short_formulas.inc'

    include 'tangent_short_integrals.inc'

    include 'tangent_middle_formulas.inc'

end module frb_flow_tangent_near
