!> Legendre's integral of the third kind: table, closed forms, half turns, edges, refused input.
module frb_test_legendre
    use frb_agm, only: ellip_f, ellip_k, landen_step
    use frb_carlson, only: rf, rd
    use frb_checks, only: tally, largest
    use frb_claims, only: pi_error
    use frb_elliptic_table, only: table_entry, read_table, columns_of
    use frb_kinds, only: wp, pi, half_pi
    use frb_legendre, only: ellpi, ellint_pi, ellint_pi_between
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_is_finite, ieee_value, ieee_quiet_nan, &
        ieee_positive_inf
    implicit none
    private

    public :: test_legendre

    real(wp), parameter :: eps = epsilon(1.0_wp)
    real(wp), parameter :: pi_bound = pi_error*eps

contains

    subroutine test_legendre(t)
        type(tally), intent(inout) :: t
        type(table_entry), allocatable :: table(:)
        real(wp), allocatable :: x(:, :), v(:), whole(:)

        call t%open_suite('legendre', 23)
        call read_table(table)
        call columns_of(table, 'pi', x, v)
        call t%ok('table-holds-pi', size(v) >= 80)
        call t%at_most('pi-agrees-with-table', worst(ellpi(x(:, 1), x(:, 2), 0.0_wp, x(:, 3)), v, abs(v)), &
                       pi_bound)
        call columns_of(table, 'pid', x, v)
        allocate (whole(size(v)))
        whole(:) = abs(ellint_pi(0.0_wp, x(:, 1), x(:, 3), 0.0_wp, x(:, 4))) &
            + abs(ellint_pi(0.0_wp, x(:, 2), x(:, 3), 0.0_wp, x(:, 4)))
        call t%ok('table-holds-pi-between-amplitudes', size(v) >= 35)
        call t%at_most('difference-of-any-amplitudes-agrees-with-table', &
                       worst(ellint_pi(x(:, 1), x(:, 2), x(:, 3), 0.0_wp, x(:, 4)), v, whole), pi_bound)
        call closed_forms(t)
        call half_turns_count(t)
        call edges(t)
        call refusals(t)
        call t%close_suite()
    end subroutine test_legendre

    subroutine closed_forms(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: phi(4) = [0.2_wp, -1.1_wp, 1.5_wp, half_pi]
        real(wp), parameter :: k = 0.7_wp
        real(wp) :: s(4), c(4), delta(4), second(4)

        s = sin(phi)
        c = cos(phi)
        delta = sqrt(1 - (k*s)**2)
        call t%close_to('n-zero-is-the-first-kind', ellpi(phi, 0.0_wp, k), ellip_f(phi, k), 2*pi_bound)
        second = s*rf(c*c, delta**2, 1.0_wp) - k*k*s**3*rd(c*c, delta**2, 1.0_wp)/3
        call t%close_to('n-equal-k-squared-is-the-second-kind', ellpi(phi, k*k, k), &
                        (second - k*k*s*c/delta)/(1 - k*k), 4*pi_bound)
        call t%close_to('k-zero-is-an-arctangent', ellpi(phi, 0.6_wp, 0.0_wp), &
                        atan2(sqrt(0.4_wp)*s, c)/sqrt(0.4_wp), 2*pi_bound*3)
        call t%close_to('k-zero-and-large-negative-n-is-an-arctangent', ellpi(phi, -1.0e6_wp, 0.0_wp), &
                        atan2(sqrt(1000001.0_wp)*s, c)/sqrt(1000001.0_wp), pi_bound*0.002_wp)
        call t%close_to('k-one-is-elementary', ellpi(phi(1:3), -0.5_wp, 1.0_wp), &
                        (asinh(tan(phi(1:3))) + sqrt(0.5_wp)*atan(sqrt(0.5_wp)*s(1:3)))/1.5_wp, pi_bound*3)
        call t%close_to('both-sides-of-n-minus-one-join', ellpi(phi, -1.0_wp - 4*eps, k), &
                        ellpi(phi, -1.0_wp, k), 4*pi_bound)
        call t%close_to('odd-in-the-amplitude', ellpi(-phi, 0.3_wp, k), -ellpi(phi, 0.3_wp, k), 0.0_wp)
        call t%close_to('complements-give-the-same', ellpi(phi, 0.3_wp, 0.6_wp, kc2=0.64_wp, nc=0.7_wp), &
                        ellpi(phi, 0.3_wp, 0.6_wp), 4*pi_bound)
    end subroutine closed_forms

    subroutine half_turns_count(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: n = -0.4_wp, k = 0.8_wp
        real(wp) :: complete, sn, cn, dn, phi0, phi1, plain, start

        complete = ellpi(half_pi, n, k)
        call t%close_to('each-half-turn-adds-twice-the-complete-integral', &
                        ellint_pi([0.3_wp, 0.3_wp], 0.3_wp + [1, -7]*pi, n, k), [2, -14]*complete, &
                        14*pi_bound)
        call t%close_to('ways-add-up', ellint_pi(-2.0_wp, 9.0_wp, n, k), &
                        ellint_pi(-2.0_wp, 1.0_wp, n, k) + ellint_pi(1.0_wp, 9.0_wp, n, k), 10*pi_bound)
        start = 2.3_wp
        call landen_step(sin(start), cos(start), 33.0_wp, k, sn, cn, dn, phi0, phi1)
        plain = ellint_pi(phi0, phi1, n, k)
        call t%close_to('integral-from-sines-is-the-integral-from-amplitudes', &
                        ellint_pi_between(phi0, sin(start), cos(start), phi1, sn, cn, n, k), plain, &
                        pi_bound*plain)
        ! at phi = pi/2, where the rounded amplitude and the sign of the cosine disagree about the half turn
        call t%close_to('sign-of-the-cosine-decides-the-half-turn', &
                        ellint_pi_between(0.0_wp, 0.0_wp, 1.0_wp, half_pi, 1.0_wp, [1, -1]*1.0e-17_wp, &
                                          n, k), [complete, complete], 2*pi_bound*complete)
        call t%close_to('billions-of-turns-are-counted', &
                        ellint_pi(0.0_wp, 1.0e11_wp, n, k)/(1.0e11_wp*complete/half_pi), 1.0_wp, 5.0e-12_wp)
    end subroutine half_turns_count

    subroutine edges(t)
        type(tally), intent(inout) :: t
        real(wp) :: infinite(4)

        infinite = [ellpi(half_pi, 0.5_wp, 1.0_wp, kc2=0.0_wp), ellint_pi(0.0_wp, 3.0_wp, 0.5_wp, 1.0_wp), &
                    ellint_pi(3.0_wp, 0.0_wp, -0.5_wp, 1.0_wp), ellint_pi(0.0_wp, 3.0_wp, 1.0_wp, 0.5_wp)]
        call t%ok('infinite-integrals-are-infinite-with-a-sign', infinite(2) > huge(1.0_wp) .and. &
                  infinite(3) < -huge(1.0_wp) .and. infinite(4) > huge(1.0_wp))
        call t%ok('the-number-half-pi-is-below-half-pi-at-k-one', ieee_is_finite(infinite(1)))
        call t%close_to('next-to-k-one-is-sharp', &
                        ellpi(half_pi, 0.5_wp, 1.0_wp, kc2=1.0e-40_wp), 74.803556254041806_wp, pi_bound*75)
        call t%close_to('tiny-amplitude-is-returned', ellpi([1.0e-300_wp, -1.0e-20_wp], 0.5_wp, 0.5_wp), &
                        [1.0e-300_wp, -1.0e-20_wp], 1.0e-35_wp)
    end subroutine edges

    subroutine refusals(t)
        type(tally), intent(inout) :: t
        real(wp) :: nan, inf

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        inf = ieee_value(1.0_wp, ieee_positive_inf)
        call t%ok('outside-the-domain-gives-nan', &
                  all(ieee_is_nan([ellpi(1.6_wp, 0.5_wp, 0.5_wp), ellpi(1.0_wp, 2.0_wp, 0.5_wp), &
                                   ellpi(1.0_wp, 0.5_wp, 1.5_wp), ellint_pi(0.0_wp, 3.0_wp, 2.0_wp, 0.5_wp), &
                                   ellpi(1.0_wp, 0.5_wp, 0.5_wp, kc2=-0.1_wp)])))
        call t%ok('nan-or-infinity-gives-nan', &
                  all(ieee_is_nan([ellpi(nan, 0.5_wp, 0.5_wp), ellpi(1.0_wp, -inf, 0.5_wp), &
                                   ellpi(1.0_wp, 0.5_wp, nan), ellint_pi(0.0_wp, inf, 0.5_wp, 0.5_wp), &
                                   ellint_pi_between(0.0_wp, nan, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 0.5_wp, &
                                                     0.5_wp)])))
    end subroutine refusals

    !> Largest error in units of `unit`.
    pure function worst(got, expected, unit) result(error)
        real(wp), intent(in) :: got(:), expected(:), unit(:)
        real(wp) :: error

        error = largest(abs(got - expected)/unit)
    end function worst

end module frb_test_legendre
