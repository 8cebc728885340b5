!> Gauss-Legendre rules, and the integral of the third kind by them.
module frb_test_quadrature
    use frb_checks, only: tally, worst_of
    use frb_claims, only: nodes_error, weight_error, far_weight_error
    use frb_elliptic_table, only: table_entry, read_table, columns_of
    use frb_kinds, only: wp, pi, most_points
    use frb_legendre, only: ellint_pi
    use frb_matrix_step, only: frb_step
    use frb_quadrature, only: gauss_legendre, eint_gauss
    use frb_quat_step, only: quat_step
    use frb_rotations, only: quat_to_matrix
    use frb_status, only: status_ok, status_bad_count
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: test_quadrature

    real(wp), parameter :: eps = epsilon(1.0_wp)
    real(wp), parameter :: node_bound = nodes_error*eps              ! absolute
    real(wp), parameter :: table_weight_bound = weight_error*eps       ! relative, up to 10 points
    real(wp), parameter :: weight_bound = far_weight_error*eps         ! relative, beyond

contains

    subroutine test_quadrature(t)
        type(tally), intent(inout) :: t

        call t%open_suite('quadrature', 19)
        call rules(t)
        call integrals(t)
        call refusals(t)
        call t%close_suite()
    end subroutine test_quadrature

    subroutine rules(t)
        type(tally), intent(inout) :: t
        type(table_entry), allocatable :: table(:)
        real(wp), allocatable :: x(:, :), v(:), nodes(:), weights(:)
        real(wp) :: node_error, small_error, large_error, error, moment
        integer :: i, np, degree
        logical :: ascending

        call read_table(table)
        call columns_of(table, 'gx', x, v)
        node_error = 0.0_wp
        do i = 1, size(v)
            np = nint(x(i, 1))
            call rule(np, nodes, weights)
            node_error = worst_of(node_error, abs(nodes(nint(x(i, 2))) - v(i)))
        end do
        call t%ok('table-holds-nodes', size(v) >= 40)
        call t%at_most('nodes-agree-with-table', node_error, node_bound)
        call columns_of(table, 'gw', x, v)
        small_error = 0.0_wp
        large_error = 0.0_wp
        do i = 1, size(v)
            np = nint(x(i, 1))
            call rule(np, nodes, weights)
            error = abs(weights(nint(x(i, 2)))/v(i) - 1)
            if (np <= 10) small_error = worst_of(small_error, error)
            if (np > 10) large_error = worst_of(large_error, error)
        end do
        call t%at_most('weights-up-to-10-points-agree-with-table', small_error, table_weight_bound)
        call t%at_most('weights-beyond-10-points-agree-with-table', large_error, weight_bound)
        error = 0.0_wp
        ascending = .true.
        do np = 1, 30
            call rule(np, nodes, weights)
            if (any(nodes(2:) <= nodes(:np - 1)) .or. any(weights <= 0.0_wp)) ascending = .false.
            do degree = 0, 2*np - 1
                moment = 0.0_wp
                if (modulo(degree, 2) == 0) moment = 2.0_wp/(degree + 1)
                error = worst_of(error, abs(sum(weights*nodes**degree) - moment))
            end do
        end do
        call t%at_most('gauss-n-is-exact-to-degree-2n-minus-1', error, 16*eps)
        call t%ok('nodes-ascend-and-weights-are-positive', ascending)
        call rule(3, nodes, weights)
        call t%ok('gauss-n-is-not-exact-to-degree-2n', abs(sum(weights*nodes**6) - 2.0_wp/7) > 1.0e-3_wp)
        call rule(400, nodes, weights)
        call t%close_to('gauss-400-integrates-an-exponential', sum(weights*exp(nodes)), &
                        exp(1.0_wp) - exp(-1.0_wp), 20*eps)
    end subroutine rules

    subroutine integrals(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: n = -0.7_wp, k = 0.6_wp, phi = 0.4_wp
        real(wp) :: exact, coarse, fine, order(3)
        integer :: np

        exact = ellint_pi(phi, phi + 2.5_wp, n, k)
        call t%close_to('gauss-40-is-the-third-kind', eint_gauss(phi, phi + 2.5_wp, n, k, 40), exact, &
                        8*eps*exact)
        call t%close_to('complements-give-the-same', &
                        eint_gauss(phi, 1.0_wp, 9.0_wp, 9.0_wp, 10, kc2=1 - k*k, nc=1 - n), &
                        eint_gauss(phi, 1.0_wp, n, k, 10), 4*eps)
        do np = 1, 3
            coarse = eint_gauss(phi, phi + 0.4_wp, n, k, np) - ellint_pi(phi, phi + 0.4_wp, n, k)
            fine = eint_gauss(phi, phi + 0.2_wp, n, k, np) &
                + eint_gauss(phi + 0.2_wp, phi + 0.4_wp, n, k, np) &
                - ellint_pi(phi, phi + 0.4_wp, n, k)
            order(np) = log(abs(coarse/fine))/log(2.0_wp)
        end do
        call t%close_to('order-is-twice-the-number-of-points', order, [2.0_wp, 4.0_wp, 6.0_wp], 0.3_wp)
        call t%close_to('backwards-is-the-negative', eint_gauss(1.3_wp, phi, n, k, 3), &
                        -eint_gauss(phi, 1.3_wp, n, k, 3), 2*eps)
    end subroutine integrals

    subroutine refusals(t)
        type(tally), intent(inout) :: t
        real(wp) :: nodes(4), weights(4), value, nan
        integer :: stat, stat_short, stat_sum

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        call gauss_legendre(0, nodes, weights, stat)
        call gauss_legendre(5, nodes, weights, stat_short)
        call t%ok('no-points-or-short-arrays-set-stat', stat == status_bad_count &
                  .and. stat_short == status_bad_count .and. maxval(abs([nodes, weights])) <= 0.0_wp)
        value = eint_gauss(0.0_wp, 1.0_wp, 0.5_wp, 0.5_wp, 0, stat=stat_sum)
        call t%ok('integral-without-points-is-nan-and-sets-stat', ieee_is_nan(value) &
                  .and. stat_sum == status_bad_count)
        value = eint_gauss(0.0_wp, 1.0_wp, 0.5_wp, 0.5_wp, 12, stat=stat_sum)
        call t%equal('accepted-points-set-ok', stat_sum, status_ok)
        call too_many_points(t)
        call t%ok('outside-the-domain-gives-nan', &
                  all(ieee_is_nan([eint_gauss(0.0_wp, 3.0_wp, 2.0_wp, 0.5_wp, 5), &
                                   eint_gauss(0.0_wp, 1.0_wp, 0.5_wp, 1.5_wp, 5), &
                                   eint_gauss(nan, 1.0_wp, 0.5_wp, 0.5_wp, 5), &
                                   eint_gauss(0.0_wp, 1.0_wp, nan, 0.5_wp, 5), &
                                   eint_gauss(0.0_wp, 1.0_wp, 0.5_wp, 0.5_wp, 5, kc2=-1.0_wp)])))
    end subroutine refusals

    !> The largest number of points is accepted by every routine that takes one, the next one and the largest
    !> integer are refused.
    subroutine too_many_points(t)
        type(tally), intent(inout) :: t
        integer, parameter :: counts(3) = [most_points, most_points + 1, huge(1)]
        real(wp), parameter :: moments(3) = [1.0_wp, 2.0_wp, 3.0_wp]
        real(wp) :: nodes(most_points + 1), weights(most_points + 1), value, m(3), q(4), attitude(3, 3)
        integer :: stat(4, 3), i

        do i = 1, 3
            m = [0.1_wp, 1.0_wp, 0.2_wp]
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            attitude = quat_to_matrix(q)
            value = eint_gauss(0.0_wp, 1.0_wp, 0.5_wp, 0.5_wp, counts(i), stat=stat(1, i))
            call gauss_legendre(counts(i), nodes, weights, stat(2, i))
            call frb_step(m, attitude, 0.1_wp, moments, m, attitude, np=counts(i), stat=stat(3, i))
            call quat_step(m, q, 0.1_wp, moments, m, q, np=counts(i), stat=stat(4, i))
        end do
        call t%ok('most-points-are-accepted', all(stat(:, 1) == status_ok))
        call t%ok('more-than-most-points-are-refused', all(stat(:, 2:) == status_bad_count))
        call t%ok('integral-with-too-many-points-is-nan', ieee_is_nan(value))
    end subroutine too_many_points

    !> The rule with np points in arrays of its size.
    subroutine rule(np, nodes, weights)
        integer, intent(in) :: np
        real(wp), allocatable, intent(out) :: nodes(:), weights(:)

        allocate (nodes(np), weights(np))
        call gauss_legendre(np, nodes, weights)
    end subroutine rule

end module frb_test_quadrature
