!> AGM/Landen: first integral, amplitude, Jacobi functions, momentum step.
module frb_test_agm
    use frb_agm, only: ellip_k, ellip_f, jacobi_am, jacobi, landen_step
    use frb_carlson, only: rf, rd
    use frb_checks, only: tally, largest, worst_of
    use frb_claims, only: k_error, f_error, am_error
    use frb_elliptic_table, only: table_entry, read_table, columns_of
    use frb_kinds, only: wp, pi, half_pi
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_is_finite, ieee_value, ieee_quiet_nan, &
        ieee_positive_inf
    implicit none
    private

    public :: test_agm

    real(wp), parameter :: eps = epsilon(1.0_wp)
    real(wp), parameter :: k_bound = k_error*eps, f_bound = f_error*eps, jacobi_bound = am_error*eps
    real(wp), parameter :: step_bound = am_error*eps   ! relative to 1 + |u| + |du|

contains

    subroutine test_agm(t)
        type(tally), intent(inout) :: t
        type(table_entry), allocatable :: table(:)
        real(wp), allocatable :: x(:, :), v(:)

        call t%open_suite('agm', 37)
        call read_table(table)
        call columns_of(table, 'k', x, v)
        call t%ok('table-holds-k', size(v) >= 40)
        call t%at_most('complete-integral-agrees-with-table', worst(ellip_k(0.0_wp, x(:, 1)), v, v), k_bound)
        call columns_of(table, 'f', x, v)
        call t%ok('table-holds-f', size(v) >= 80)
        call t%at_most('incomplete-integral-agrees-with-table', &
                       worst(ellip_f(x(:, 1), 0.0_wp, x(:, 2)), v, abs(v)), f_bound)
        call functions_against_table(t, table)
        call first_integral(t)
        call jacobi_identities(t)
        call momentum_step(t)
        call separatrix(t)
        call refusals(t)
        call t%close_suite()
    end subroutine test_agm

    subroutine functions_against_table(t, table)
        type(tally), intent(inout) :: t
        type(table_entry), intent(in) :: table(:)
        real(wp), allocatable :: x(:, :), v(:), sn(:), cn(:), dn(:), u(:)
        integer :: rows

        call columns_of(table, 'am', x, v)
        rows = size(v)
        allocate (sn(rows), cn(rows), dn(rows), u(rows))
        call jacobi(x(:, 1), 0.0_wp, sn, cn, dn, x(:, 2))
        u(:) = abs(x(:, 1))
        call t%ok('table-holds-amplitudes', rows >= 45)
        call t%at_most('amplitude-agrees-with-table', &
                       worst(jacobi_am(x(:, 1), 0.0_wp, x(:, 2)), v, abs(v) + u*dn), jacobi_bound)
        call columns_of(table, 'sn', x, v)
        call t%at_most('sn-agrees-with-table', worst(sn, v, abs(v) + u*abs(cn)*dn), jacobi_bound)
        call columns_of(table, 'cn', x, v)
        call t%at_most('cn-agrees-with-table', worst(cn, v, abs(v) + u*abs(sn)*dn), jacobi_bound)
        call columns_of(table, 'dn', x, v)
        call t%at_most('dn-agrees-with-table', worst(dn, v, abs(v) + u*abs(sn*cn)*(1 - x(:, 2))), &
                       jacobi_bound)
    end subroutine functions_against_table

    subroutine first_integral(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: k = 0.8_wp, kc2 = 0.36_wp
        real(wp) :: first, second, first_c, second_c, phi(5)

        call t%close_to('k-of-zero-is-half-pi', ellip_k(0.0_wp), half_pi, k_bound*half_pi)
        call t%close_to('f-of-zero-modulus-is-the-angle', &
                        ellip_f([0.1_wp, -3.0_wp, 50.0_wp], 0.0_wp), [0.1_wp, -3.0_wp, 50.0_wp], 100*eps)
        first = ellip_k(k)
        second = first - k*k*rd(0.0_wp, kc2, 1.0_wp)/3
        first_c = ellip_k(0.6_wp)
        second_c = first_c - kc2*rd(0.0_wp, k*k, 1.0_wp)/3
        call t%close_to('legendre-relation-holds', second*first_c + second_c*first - first*first_c, &
                        half_pi, 8*eps)
        call t%close_to('modulus-and-complement-give-the-same', ellip_f(1.2_wp, k), &
                        ellip_f(1.2_wp, 9.9_wp, kc2), 2*f_bound)
        phi = [0.3_wp, 1.5_wp, -0.9_wp, 1.0e-5_wp, half_pi]
        call t%close_to('landen-and-carlson-agree', ellip_f(phi, k), &
                        sin(phi)*rf(cos(phi)**2, cos(phi)**2 + kc2*sin(phi)**2, 1.0_wp), 2*f_bound)
        call t%close_to('f-gains-2-k-each-half-turn', ellip_f(0.4_wp + 10*pi, k), &
                        ellip_f(0.4_wp, k) + 20*first, 2*f_bound*20*first)
        call t%close_to('f-of-multiples-of-half-pi-are-multiples-of-k', &
                        ellip_f([1, 2, 3, -5]*half_pi, k), [1, 2, 3, -5]*first, 5*f_bound*first)
        call t%close_to('amplitude-inverts-f-over-billions-of-turns', &
                        jacobi_am(ellip_f(4.0e10_wp, k), k)/4.0e10_wp, 1.0_wp, 8*eps)
    end subroutine first_integral

    subroutine jacobi_identities(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: k = 0.9_wp, u = 0.7_wp, v = 2.1_wp
        real(wp) :: s(3), c(3), d(3), many(7), sm(7), cm(7), dm(7), period

        call jacobi([u, v, u + v], k, s, c, d)
        call t%close_to('sn-obeys-addition', s(3), &
                        (s(1)*c(2)*d(2) + s(2)*c(1)*d(1))/(1 - k*k*s(1)**2*s(2)**2), 16*eps)
        many = [0.0_wp, 1.0e-12_wp, 0.5_wp, -3.0_wp, 12.0_wp, 1.0e8_wp, -1.0e300_wp]
        call jacobi(many, k, sm, cm, dm)
        call t%close_to('sn-squared-plus-cn-squared-is-one', sm**2 + cm**2, &
                        [1, 1, 1, 1, 1, 1, 1]*1.0_wp, 4*eps)
        call t%close_to('dn-squared-plus-k-squared-sn-squared-is-one', dm**2 + (k*sm)**2, &
                        [1, 1, 1, 1, 1, 1, 1]*1.0_wp, 4*eps)
        period = 4*ellip_k(k)
        call jacobi([u, u + period, u - 3*period], k, s, c, d)
        call t%close_to('sn-has-period-4-k', s(2:3), [s(1), s(1)], 4*eps*3*period)
        call jacobi([u, -v, v], 0.0_wp, s, c, d)
        call t%close_to('k-to-zero-tends-to-sine-and-cosine', [s, c, d], &
                        [sin([u, -v, v]), cos([u, -v, v]), [1, 1, 1]*1.0_wp], 4*eps)
        call jacobi([u, -v, 30.0_wp], 1.0_wp, s, c, d)
        call t%close_to('k-to-one-tends-to-tanh', [s, c, d], &
                        [tanh([u, -v, 30.0_wp]), 1/cosh([u, -v, 30.0_wp]), 1/cosh([u, -v, 30.0_wp])], 4*eps)
        call jacobi([u, -v, 5.0_wp], 0.5_wp, sm(1:3), cm(1:3), dm(1:3), kc2=[1, 1, 1]*1.0e-40_wp)
        call jacobi([u, -v, 5.0_wp], 1.0_wp, s, c, d)
        call t%close_to('next-to-k-one-is-continuous', [sm(1:3), cm(1:3), dm(1:3)], [s, c, d], 8*eps)
    end subroutine jacobi_identities

    subroutine momentum_step(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: starts(6) = [0.0_wp, 0.8_wp, half_pi, 2.5_wp, 3.14159_wp, -2.9_wp]
        real(wp), parameter :: steps(5) = [1.0e-7_wp, -0.5_wp, 3.0_wp, -40.0_wp, 1.0e5_wp]
        real(wp), parameter :: complements(5) = [1.0_wp, 0.5_wp, 1.0e-3_wp, 1.0e-12_wp, 0.9999999_wp]
        real(wp) :: sn, cn, dn, phi0, phi1, s, c, d, u, error, error_am, error_phi0, error_back, s0, c0
        real(wp) :: sb, cb, db, phi_a, phi_b
        integer :: i, j, l

        error = 0.0_wp
        error_am = 0.0_wp
        error_phi0 = 0.0_wp
        error_back = 0.0_wp
        do l = 1, size(complements)
            do j = 1, size(steps)
                do i = 1, size(starts)
                    s0 = sin(starts(i))
                    c0 = cos(starts(i))
                    call landen_step(s0, c0, steps(j), 0.0_wp, sn, cn, dn, phi0, phi1, complements(l))
                    u = ellip_f(starts(i), 0.0_wp, complements(l)) + steps(j)
                    call jacobi(u, 0.0_wp, s, c, d, complements(l))
                    error = worst_of(error, abs([sn - s, cn - c, dn - d])/(1 + abs(u) + abs(steps(j))))
                    error_am = worst_of(error_am, abs(phi1 - jacobi_am(u, 0.0_wp, complements(l))) &
                                   /(1 + abs(u) + abs(steps(j))))
                    error_phi0 = worst_of(error_phi0, abs(phi0 - starts(i)))
                    call landen_step(sn, cn, -steps(j), 0.0_wp, sb, cb, db, phi_a, phi_b, complements(l))
                    if (complements(l) > 1.0e-6_wp) then
                        error_back = worst_of(error_back, abs([sb - s0, cb - c0])/(1 + abs(steps(j))))
                    end if
                end do
            end do
        end do
        call t%at_most('momentum-step-agrees-with-jacobi', error, step_bound)
        call t%at_most('amplitude-after-a-step-is-continuous-and-counts-turns', error_am, step_bound)
        call t%at_most('amplitude-at-the-start-is-the-angle', error_phi0, 4*eps)
        call t%at_most('step-back-returns-the-start', error_back, 50*eps)
        call landen_step(0.6_wp, 0.8_wp, 1.0e15_wp, 0.5_wp, sn, cn, dn, phi0, phi1)
        call t%ok('a-step-over-1e14-turns-stays-on-the-circle', abs(sn*sn + cn*cn - 1) <= 4*eps .and. &
                  abs(phi1/1.0e15_wp*ellip_k(0.5_wp)/half_pi - 1) <= 16*eps)
        call landen_step(1.0e-300_wp, -1.0_wp, 0.0_wp, 0.5_wp, sn, cn, dn, phi0, phi1)
        call t%ok('no-step-next-to-a-half-turn-changes-nothing', abs(sn) <= eps .and. cn + 1 <= eps .and. &
                  abs(phi1 - pi) <= 2*eps*pi)
    end subroutine momentum_step

    subroutine separatrix(t)
        type(tally), intent(inout) :: t
        real(wp) :: sn(3), cn(3), dn(3), phi0(3), phi1(3)
        integer :: i
        real(wp), parameter :: angle(3) = [0.4_wp, 2.8_wp, -2.0_wp]

        do i = 1, 3
            call landen_step(sin(angle(i)), cos(angle(i)), 1.5_wp, 1.0_wp, sn(i), cn(i), dn(i), &
                             phi0(i), phi1(i))
        end do
        ! on the branch cn < 0 the same motion, half a turn away
        call t%close_to('k-one-step-is-the-gudermannian-on-both-branches', sn, &
                        [tanh(asinh(tan(0.4_wp)) + 1.5_wp), -tanh(asinh(tan(2.8_wp)) + 1.5_wp), &
                         -tanh(asinh(tan(-2.0_wp)) + 1.5_wp)], 8*eps)
        call t%close_to('k-one-step-has-consistent-amplitude', [sin(phi1), cos(phi1)], [sn, cn], 8*eps)
        call landen_step(1.0_wp, 0.0_wp, 3.0_wp, 1.0_wp, sn(1), cn(1), dn(1), phi0(1), phi1(1))
        call t%close_to('the-unstable-equilibrium-stays-at-rest', [sn(1), cn(1), dn(1), phi1(1)], &
                        [1.0_wp, 0.0_wp, 0.0_wp, half_pi], eps)
    end subroutine separatrix

    subroutine refusals(t)
        type(tally), intent(inout) :: t
        real(wp) :: nan, inf, s, c, d, a, b

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        inf = ieee_value(1.0_wp, ieee_positive_inf)
        call t%ok('k-at-one-is-infinite', .not. ieee_is_finite(ellip_k(1.0_wp)) .and. &
                  .not. ieee_is_nan(ellip_k(1.0_wp)) .and. .not. ieee_is_nan(ellip_f(2.0_wp, 1.0_wp)))
        call t%ok('modulus-above-one-or-not-finite-gives-nan', &
                  all(ieee_is_nan([ellip_k(1.1_wp), ellip_k(nan), ellip_k(0.5_wp, -0.1_wp), &
                                   ellip_k(0.5_wp, 1.1_wp), ellip_f(1.0_wp, 1.1_wp), ellip_f(inf, 0.5_wp), &
                                   jacobi_am(nan, 0.5_wp), &
                                   jacobi_am(1.0_wp, -1.1_wp)])))
        call jacobi(inf, 0.5_wp, s, c, d)
        call t%ok('infinite-argument-gives-nan', all(ieee_is_nan([s, c, d])))
        call landen_step(0.5_wp, 0.5_wp, nan, 0.5_wp, s, c, d, a, b)
        call t%ok('refused-step-gives-nan-throughout', all(ieee_is_nan([s, c, d, a, b])))
    end subroutine refusals

    !> Largest error in units of `unit`; another size counts as huge.
    pure function worst(got, expected, unit) result(error)
        real(wp), intent(in) :: got(:), expected(:), unit(:)
        real(wp) :: error

        error = huge(1.0_wp)
        if (size(got) == size(expected)) error = largest(abs(got - expected)/max(unit, tiny(unit)))
    end function worst

end module frb_test_agm
