!> Carlson's integrals: table, identities, limits, edges, refused input.
module frb_test_carlson
    use frb_carlson, only: rf, rc, rj, rd, rf_and_rj
    use frb_checks, only: tally, largest, worst_of
    use frb_claims, only: rf_error, rc_error, rj_error
    use frb_elliptic_table, only: table_entry, read_table, columns_of
    use frb_kinds, only: wp, pi
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_is_finite, ieee_value, ieee_quiet_nan, &
        ieee_positive_inf
    implicit none
    private

    public :: test_carlson

    real(wp), parameter :: eps = epsilon(1.0_wp)
    real(wp), parameter :: rf_bound = rf_error*eps, rc_bound = rc_error*eps, rj_bound = rj_error*eps
    real(wp), parameter :: principal_value_bound = 60*eps   ! near a zero of the principal value

contains

    subroutine test_carlson(t)
        type(tally), intent(inout) :: t
        type(table_entry), allocatable :: table(:)
        real(wp), allocatable :: x(:, :), v(:), errors(:)

        call t%open_suite('carlson', 28)
        call read_table(table)
        call columns_of(table, 'rf', x, v)
        call t%ok('table-holds-rf', size(v) >= 45)
        call t%at_most('rf-agrees-with-table', worst(rf(x(:, 1), x(:, 2), x(:, 3)), v), rf_bound)
        call columns_of(table, 'rc', x, v)
        call t%ok('table-holds-rc', size(v) >= 45)
        call t%at_most('rc-agrees-with-table', worst(rc(x(:, 1), x(:, 2)), v), rc_bound)
        call columns_of(table, 'rj', x, v)
        allocate (errors(size(v)))
        errors(:) = abs(rj(x(:, 1), x(:, 2), x(:, 3), x(:, 4))/v - 1)
        call t%ok('table-holds-rj-and-its-principal-value', count(x(:, 4) > 0.0_wp) >= 80 &
                  .and. count(x(:, 4) < 0.0_wp) >= 4)
        call t%at_most('rj-agrees-with-table', largest(pack(errors, x(:, 4) > 0.0_wp)), rj_bound)
        call t%at_most('principal-value-of-rj-agrees-with-table', largest(pack(errors, x(:, 4) < 0.0_wp)), &
                       principal_value_bound)
        call columns_of(table, 'rd', x, v)
        call t%ok('table-holds-rd', size(v) >= 40)
        call t%at_most('rd-agrees-with-table', worst(rd(x(:, 1), x(:, 2), x(:, 3)), v), rj_bound)
        call identities(t)
        call series_at_their_radius(t)
        call refusals(t)
        call t%close_suite()
    end subroutine test_carlson

    subroutine identities(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: x = 0.3_wp, y = 0.7_wp, z = 1.9_wp, p = 0.45_wp
        real(wp) :: lambda, first, third, sums(3)

        ! values printed by Carlson (1995), section 4
        call t%close_to('rf-has-the-published-value', rf(1.0_wp, 2.0_wp, 0.0_wp), 1.3110287771461_wp, &
                        1.0e-13_wp)
        call t%close_to('rj-has-the-published-value', rj(2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp), &
                        0.14297579667157_wp, 1.0e-14_wp)
        call t%close_to('rf-of-equal-arguments-is-inverse-root', rf(x, x, x), 1/sqrt(x), rf_bound/sqrt(x))
        call t%close_to('rj-of-equal-arguments-is-inverse-root-cubed', rj(z, z, z, z), z**(-1.5_wp), rj_bound)
        call t%close_to('rc-of-0-and-a-quarter-is-pi', rc(0.0_wp, 0.25_wp), pi, rc_bound*pi)
        call t%close_to('rc-of-nine-quarters-and-2-is-log-2', rc(2.25_wp, 2.0_wp), log(2.0_wp), rc_bound)
        call t%close_to('rf-is-homogeneous-of-degree-minus-a-half', &
                        rf(1.0e30_wp*x, 1.0e30_wp*y, 1.0e30_wp*z), 1.0e-15_wp*rf(x, y, z), &
                        2*rf_bound*1.0e-15_wp*rf(x, y, z))
        call t%close_to('rj-is-homogeneous-of-degree-minus-three-halves', &
                        rj(1.0e80_wp*x, 1.0e80_wp*y, 1.0e80_wp*z, 1.0e80_wp*p)*1.0e120_wp, rj(x, y, z, p), &
                        2*rj_bound*rj(x, y, z, p))
        call t%close_to('rj-is-symmetric', rj(z, x, y, p), rj(x, y, z, p), rj_bound*rj(x, y, z, p))
        lambda = sqrt(x*y) + sqrt(x*z) + sqrt(y*z)
        call t%close_to('rf-obeys-duplication', 2*rf(x + lambda, y + lambda, z + lambda), rf(x, y, z), &
                        2*rf_bound*rf(x, y, z))
        call t%close_to('rj-with-p-equal-z-is-rd', rj(x, y, z, z), rd(x, y, z), 2*rj_bound*rd(x, y, z))
        sums = [rd(y, z, x), rd(z, x, y), rd(x, y, z)]
        call t%close_to('three-rd-sum-to-inverse-root', sum(sums), 3/sqrt(x*y*z), 3*rj_bound*sum(sums))
        call rf_and_rj(x, y, z, p, first, third)
        call t%close_to('rf-and-rj-together-are-rf-and-rj', [first, third], [rf(x, y, z), rj(x, y, z, p)], &
                        rj_bound*third)
    end subroutine identities

    !> Arguments just close enough for the series alone, against the value after one more duplication.
    subroutine series_at_their_radius(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: far(4, 4) = reshape([-1, -1, 0, 1, 1, 1, 0, -1, &
                                                   -1, -1, -1, 1, 1, -1, 0, 0]*1.0_wp, &
                                                   [4, 4])
        real(wp) :: x(3), p, lambda, d, delta, first, third
        integer :: i

        first = 0.0_wp
        third = 0.0_wp
        do i = 1, 4
            x = 1 + 0.05_wp*far(1:3, i)
            lambda = sqrt(x(1)*x(2)) + sqrt(x(1)*x(3)) + sqrt(x(2)*x(3))
            first = worst_of(first, abs(2*rf(x(1) + lambda, x(2) + lambda, x(3) + lambda) &
                                   /rf(x(1), x(2), x(3)) - 1))
            x = 1 + 0.0195_wp*far(1:3, i)
            p = 1 + 0.0195_wp*far(4, i)
            lambda = sqrt(x(1)*x(2)) + sqrt(x(1)*x(3)) + sqrt(x(2)*x(3))
            d = product(sqrt(p) + sqrt(x))
            delta = product(p - x)
            third = worst_of(third, abs((2*rj(x(1) + lambda, x(2) + lambda, x(3) + lambda, p + lambda) &
                                    + 6/d*rc(1.0_wp, 1 + delta/d**2))/rj(x(1), x(2), x(3), p) - 1))
        end do
        call t%at_most('series-of-rf-is-sharp-at-its-radius', first, rf_bound)
        call t%at_most('series-of-rj-is-sharp-at-its-radius', third, rj_bound)
    end subroutine series_at_their_radius

    subroutine refusals(t)
        type(tally), intent(inout) :: t
        real(wp) :: nan, inf

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        inf = ieee_value(1.0_wp, ieee_positive_inf)
        call t%ok('negative-argument-or-two-zeros-give-nan', &
                  all(ieee_is_nan([rf(-1.0_wp, 1.0_wp, 1.0_wp), rf(0.0_wp, 0.0_wp, 1.0_wp), &
                                   rc(-1.0_wp, 1.0_wp), rc(1.0_wp, 0.0_wp), &
                                   rj(1.0_wp, -1.0_wp, 1.0_wp, 1.0_wp), &
                                   rj(0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp), rj(1.0_wp, 1.0_wp, 1.0_wp, 0.0_wp), &
                                   rd(0.0_wp, 0.0_wp, 1.0_wp), rd(1.0_wp, 1.0_wp, 0.0_wp), &
                                   rd(1.0_wp, 1.0_wp, -1.0_wp)])))
        call t%ok('nan-or-infinity-gives-nan', &
                  all(ieee_is_nan([rf(nan, 1.0_wp, 1.0_wp), rf(1.0_wp, inf, 1.0_wp), rc(nan, 1.0_wp), &
                                   rc(1.0_wp, -inf), rj(1.0_wp, 1.0_wp, 1.0_wp, nan), &
                                   rj(inf, 1.0_wp, 1.0_wp, 1.0_wp), rd(1.0_wp, 1.0_wp, nan)])))
        call t%ok('arguments-of-extreme-size-give-a-number', extremes_are_accepted())
        call t%ok('rj-beyond-the-largest-number-is-infinite', &
                  .not. ieee_is_finite(rj(1.0e-300_wp, 1.0e-300_wp, 1.0e-300_wp, 1.0e-300_wp)) .and. &
                  .not. ieee_is_nan(rj(1.0e-300_wp, 1.0e-300_wp, 1.0e-300_wp, 1.0e-300_wp)))
    end subroutine refusals

    !> Every combination of extreme and plain arguments in the domain gives a value above zero, without an
    !> exception (in a build that traps them).
    function extremes_are_accepted() result(accepted)
        real(wp), parameter :: sizes(7) = [4.9406564584124654e-324_wp, 1.0e-200_wp, 1.0e-60_wp, 1.0_wp, &
                                           1.0e100_wp, 1.0e200_wp, huge(1.0_wp)]
        logical :: accepted
        integer :: i, j, l

        accepted = .true.
        do i = 1, size(sizes)
            do j = 1, size(sizes)
                accepted = accepted .and. rc(sizes(i), sizes(j)) > 0.0_wp
                do l = 1, size(sizes)
                    accepted = accepted .and. rf(0.0_wp, sizes(i), sizes(j)) > 0.0_wp &
                        .and. rf(sizes(i), sizes(j), sizes(l)) > 0.0_wp &
                        .and. rj(0.0_wp, sizes(i), sizes(j), sizes(l)) >= 0.0_wp &
                        .and. rj(1.0_wp, sizes(i), sizes(j), sizes(l)) >= 0.0_wp
                end do
            end do
        end do
    end function extremes_are_accepted

    !> Largest relative error.
    pure function worst(got, expected) result(error)
        real(wp), intent(in) :: got(:), expected(:)
        real(wp) :: error

        error = largest(abs(got/expected - 1))
    end function worst

end module frb_test_carlson
