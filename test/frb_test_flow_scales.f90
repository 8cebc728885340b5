!> free_flow of numbers of any size: other units, extreme momenta, moments and times, and none at all.
module frb_test_flow_scales
    use frb_checks, only: tally, largest, worst_of
    use frb_flow_samples, only: stream, advanced, same_bits, defect, no_rotation
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp
    use frb_rotations, only: norm3
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: test_flow_scales

    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Norms, energy and momentum in space after one step of any size.
    real(wp), parameter :: on_the_orbit = 32*eps

contains

    subroutine test_flow_scales(t)
        type(tally), intent(inout) :: t

        call t%open_suite('flow-scales', 18)
        call check_scales(t)
        call check_nothing(t)
        call check_by_tensor(t)
        call t%close_suite()
    end subroutine test_flow_scales

    !> The change of a momentum near the largest number is beyond it. A body by tensor adds this change.
    subroutine check_by_tensor(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: m(3), n(3), q(4), p(4), h, worst
        integer :: i

        body = rigid_body(reshape([2.0_wp, 0.3_wp, 0.1_wp, 0.3_wp, 3.0_wp, 0.2_wp, 0.1_wp, 0.2_wp, 4.0_wp], &
                                  [3, 3]))
        worst = 0.0_wp
        do i = 1, 200
            m = huge(1.0_wp)*random%uniform(0.5_wp, 0.99_wp)*random%direction()
            h = random%uniform(0.0_wp, 20.0_wp)/huge(1.0_wp)
            n = m/1024
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            p = q
            call free_flow(body, h, m, q)
            call free_flow(body, 1024*h, n, p)
            worst = worst_of(worst, [abs(m/1024 - n)/norm3(n), abs(q - p)])
        end do
        call t%at_most('by-tensor-momenta-near-the-largest-number', worst, 16*eps)
    end subroutine check_by_tensor

    !> Other units, by powers of 2, give the same bits as long as no number is denormal.
    subroutine check_scales(t)
        type(tally), intent(inout) :: t
        integer, parameter :: powers(8) = [-900, -500, -200, -20, 20, 200, 500, 900]
        type(stream) :: random
        real(wp) :: moments(3), m0(3), h, state(7), other(7), by_m, by_i, denormal
        integer :: i, j

        by_m = 0.0_wp
        by_i = 0.0_wp
        denormal = 0.0_wp
        do i = 1, 100
            moments = random%triangle()
            m0 = random%direction()
            h = sign(random%log_uniform(-6.0_wp, 2.0_wp), random%uniform(-1.0_wp, 1.0_wp))
            state = advanced(moments, m0, h)
            do j = 1, size(powers)
                other = advanced(moments, scale(m0, powers(j)), scale(h, -powers(j)))
                by_m = worst_of(by_m, [abs([scale(other(1:3), -powers(j)), other(4:7)] - state)])
                other = advanced(scale(moments, powers(j)), m0, scale(h, powers(j)))
                by_i = worst_of(by_i, [abs(other - state)])
            end do
            ! Denormal momenta: 2^-1030 |m|, of spacing 2^-1074. The time stays below overflow.
            other = advanced(moments, scale(m0, -1030), scale(h, 1000))
            state = advanced(moments, scale(scale(m0, -1030), 1030), scale(h, -30))
            denormal = worst_of(denormal, [abs(scale(other(1:3), 1030) - state(1:3))/scale(1.0_wp, -44), &
                                           abs(other(4:7) - state(4:7))/eps])
        end do
        call t%at_most('momentum-scales-as-one-over-time-to-the-last-bit', by_m, 0.0_wp)
        call t%at_most('moments-scale-as-time-to-the-last-bit', by_i, 0.0_wp)
        call t%at_most('denormal-momenta-move-to-their-last-bit', denormal, 1.0_wp)
        call check_extremes(t, random)
    end subroutine check_scales

    !> Extreme momenta, moments and times stay on the orbit.
    subroutine check_extremes(t, random)
        type(tally), intent(inout) :: t
        type(stream), intent(inout) :: random
        real(wp), parameter :: sizes(8) = [1.0e-290_wp, 1.0e-200_wp, 1.0e-100_wp, 1.0e-10_wp, 1.0_wp, &
                                           1.0e50_wp, 1.0e150_wp, 1.0e300_wp]
        real(wp) :: moments(3), m0(3), h, state(7), worst(4), longest
        integer :: i, j, k, l
        logical :: good

        worst = 0.0_wp
        good = .true.
        do i = 1, size(sizes)
            do j = 1, size(sizes)
                do k = 1, size(sizes)
                    do l = 1, 3
                        moments = sizes(i)*random%triangle()
                        m0 = sizes(j)*random%direction()
                        if (l == 3) moments([1, 3]) = moments([3, 1])
                        state = advanced(moments, m0, sign(sizes(k), real(l, wp) - 1.5_wp))
                        if (all(ieee_is_finite(state))) then
                            worst = worst_of(worst, defect(moments, m0, state))
                        else
                            good = .false.
                        end if
                    end do
                end do
            end do
        end do
        call t%ok('extreme-numbers-stay-finite', good)
        call t%at_most('extreme-numbers-keep-q-unit', worst(1), on_the_orbit)
        call t%at_most('extreme-numbers-keep-the-norm-of-m', worst(2), on_the_orbit)
        call t%at_most('extreme-numbers-keep-the-energy', worst(3), on_the_orbit)
        call t%at_most('extreme-numbers-keep-the-momentum-in-space', worst(4), on_the_orbit)

        ! The largest numbers, at any time: sums and products must not overflow.
        worst = 0.0_wp
        longest = huge(1.0_wp)
        do i = 1, 20
            m0 = huge(1.0_wp)*random%uniform(0.5_wp, 1.0_wp)*random%direction()
            if (i == 1) m0 = [0.5_wp, 0.5_wp, -0.5_wp]*huge(1.0_wp)
            moments = merge(random%triangle()*huge(1.0_wp), &
                            random%triangle()*sqrt(huge(1.0_wp))*tiny(1.0_wp), mod(i, 2) == 0)
            state = advanced(moments, m0, merge(longest, -1.0_wp/longest, mod(i, 4) < 2))
            worst = worst_of(worst, defect(moments, m0, state))
        end do
        call t%at_most('largest-numbers-stay-on-the-orbit', largest(worst), on_the_orbit)
        moments = [tiny(1.0_wp), 1.0_wp, huge(1.0_wp)]
        worst = 0.0_wp
        do i = 1, 20
            m0 = random%direction()
            h = sign(random%log_uniform(-300.0_wp, 300.0_wp), real(i, wp) - 10.5_wp)
            state = advanced(moments, m0, h)
            worst = worst_of(worst, defect(moments, m0, state))
        end do
        call t%at_most('moments-of-all-sizes-at-once-stay-on-the-orbit', largest(worst([1, 2, 4])), &
                       on_the_orbit)
    end subroutine check_extremes

    !> No time, no momentum, no bodies: nothing moves, to the last bit.
    subroutine check_nothing(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [0.4_wp, 0.7_wp, 1.0_wp], m0(3) = [0.3_wp, -0.9_wp, 0.5_wp]
        real(wp), parameter :: q0(4) = [0.5_wp, -0.5_wp, 0.1_wp, 0.7_wp]
        type(rigid_body) :: body, none(0)
        real(wp) :: m(3), q(4), a(3, 3), h, many_m(3, 33), many_q(4, 33), no_m(3, 0), no_q(4, 0)
        integer :: i, stat(4)
        character(6), parameter :: names(3) = ['0     ', '-0    ', '1e-300']

        body = rigid_body(moments)
        do i = 1, 3
            h = 0.0_wp
            if (i == 2) h = -h
            if (i == 3) h = 1.0e-300_wp
            m = m0
            q = q0
            call free_flow(body, h, m, q)
            many_m = spread(m0, 2, 33)
            many_q = spread(q0, 2, 33)
            call free_flow(body, h, many_m, many_q)
            call t%ok('nothing-moves-in-a-time-of-'//trim(names(i)), same_bits([m, q], [m0, q0]) .and. &
                      same_bits([many_m, many_q], &
                           [spread(m0, 2, 33), spread(q0, 2, 33)]))
        end do
        m = 0.0_wp
        m(2) = -m(2)
        many_m = spread(m, 2, 33)
        many_q = spread(q0, 2, 33)
        q = q0
        a = no_rotation
        call free_flow(body, 3.0_wp, m, stat(1))
        call free_flow(body, 3.0_wp, m, q, stat(2))
        call free_flow(body, 3.0_wp, m, a, stat(3))
        call free_flow(body, 3.0_wp, many_m, many_q, stat(4))
        call t%ok('no-momentum-stays-none', same_bits(m, [0.0_wp, -0.0_wp, 0.0_wp]) .and. &
                  same_bits([many_m], [spread(m, 2, 33)]))
        call t%ok('no-momentum-is-no-turn', same_bits([q, reshape(a, [9]), reshape(many_q, [132])], &
                                                 [q0, reshape(no_rotation, [9]), &
                                                  reshape(spread(q0, 2, 33), [132])]))
        call t%ok('no-momentum-is-no-error', all(stat == 0))
        call free_flow(body, 1.0_wp, no_m, stat(1))
        call free_flow(body, 1.0_wp, no_m, no_q, stat(2))
        call free_flow(none, 1.0_wp, no_m, stat(3))
        call free_flow(none, 1.0_wp, no_m, no_q, stat(4))
        call t%ok('no-bodies-are-no-error', all(stat == 0))
    end subroutine check_nothing

end module frb_test_flow_scales
