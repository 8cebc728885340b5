!> Splitting schemes: their orders by the order conditions, palindromes, refused coefficients.
module frb_test_schemes
    use frb_checks, only: tally, largest
    use frb_kinds, only: wp
    use frb_order_conditions, only: order_report, order_conditions
    use frb_schemes, only: splitting_scheme, scheme_names, mirrored, most_stages
    use frb_status, only: status_ok, status_bad_option, status_bad_scheme
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: test_schemes

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_schemes(t)
        type(tally), intent(inout) :: t

        call t%open_suite('schemes', 167)
        call test_named(t)
        call test_conditions(t)
        call test_modified(t)
        call test_own(t)
        call test_refused(t)
        call t%close_suite()
    end subroutine test_schemes

    !> Every named scheme has the properties in the table of frb_schemes.
    subroutine test_named(t)
        type(tally), intent(inout) :: t
        ! strang, yoshida4, srkn6, s6, srkn11, srkn14, srkn17, aba864, aba1064, fg4, fg6a, fg6b, fg8
        integer, parameter :: stages(13) = [1, 3, 6, 6, 11, 14, 17, 7, 8, 4, 5, 5, 11]
        integer, parameter :: orders(13) = [2, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4]
        integer, parameter :: nystroem_orders(13) = [2, 4, 4, 4, 6, 6, 8, 4, 4, 4, 6, 6, 8]
        logical, parameter :: drift_first(13) = [.true., .true., .false., .true., .false., .true., .false., &
                                                 .true., .true., .false., .true., .false., .true.]
        type(splitting_scheme) :: scheme
        type(order_report) :: report
        character(:), allocatable :: name
        integer :: i

        call t%equal('there-are-thirteen-named-schemes', size(scheme_names), 13)
        do i = 1, 13
            name = trim(scheme_names(i))
            scheme = splitting_scheme(name)
            report = scheme%conditions()
            call t%equal(name//'-is-made', scheme%status, status_ok)
            call t%equal(name//'-has-its-number-of-stages', scheme%stages(), stages(i))
            call t%equal(name//'-has-its-order-for-any-two-flows', report%order, orders(i))
            call t%equal(name//'-has-its-order-under-the-nystroem-condition', report%nystroem_order, &
                         nystroem_orders(i))
            call t%ok(name//'-opens-with-the-flow-it-should', scheme%drift_first .eqv. drift_first(i))
            call t%close_to(name//'-coefficients-sum-to-one', &
                            [sum(scheme%drift_coefficients()), sum(scheme%kick_coefficients())], &
                            [1.0_wp, 1.0_wp], 4*eps)
            ! Published digits, and rounding: any misprint beyond the 14th digit shows.
            call t%at_most(name//'-meets-its-conditions-to-rounding', &
                           largest(report%nystroem_residuals(1:nystroem_orders(i))), 8*eps)
            call t%ok(name//'-misses-the-next-conditions-clearly', &
                      report%nystroem_residuals(nystroem_orders(i) + 1) > 1.0e-8_wp)
        end do
        scheme = splitting_scheme('aba864')
        report = scheme%conditions()
        call t%ok('aba864-has-orders-8-6-4-for-a-small-torque', all(report%kick_orders == [8, 6, 4]))
        scheme = splitting_scheme('aba1064')
        report = scheme%conditions()
        call t%ok('aba1064-has-orders-10-6-4-for-a-small-torque', all(report%kick_orders == [10, 6, 4]))
        do i = 1, 13
            scheme = splitting_scheme(trim(scheme_names(i)))
            call t%ok(trim(scheme_names(i))//'-has-modified-kicks-or-not', &
                      scheme%has_modified_kicks() .eqv. i >= 10)
        end do
        scheme = splitting_scheme('strang')
        call t%close_to('strang-is-half-a-drift-a-kick-half-a-drift', &
                        [scheme%drift_coefficients(), scheme%kick_coefficients()], &
                        [0.5_wp, 0.5_wp, 1.0_wp], 0.0_wp)
        scheme = splitting_scheme('aba864')
        call t%close_to('centres-of-aba864-are-the-published-ones', [scheme%half_a(4), scheme%half_b(4)], &
                        [-0.333698616227678005726562603400438876027_wp, &
                         0.0653961422823734184559721793911134363710_wp], 2*eps)
        scheme = splitting_scheme('srkn14')
        call t%close_to('srkn14-reads-the-same-backwards', scheme%drift_coefficients(), &
                        reversed(scheme%drift_coefficients()), 0.0_wp)
        call t%close_to('centres-of-srkn14-are-the-published-ones', [scheme%half_a(8), scheme%half_b(7)], &
                        [0.20730506905689536_wp, -0.196411466486454234_wp], 2*eps)
    end subroutine test_named

    !> Order conditions on compositions whose order is known by theory.
    subroutine test_conditions(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: ruth_a(3) = [7/24.0_wp, 3/4.0_wp, -1/24.0_wp]
        real(wp), parameter :: ruth_b(3) = [2/3.0_wp, -2/3.0_wp, 1.0_wp]
        type(order_report) :: report
        type(splitting_scheme) :: scheme, misprint
        real(wp) :: steps(27), w
        real(wp), allocatable :: a(:)
        integer :: level, n, i

        report = order_conditions([1.0_wp], [1.0_wp], drift_first=.true.)
        call t%equal('drift-then-kick-has-order-one', report%order, 1)
        call t%close_to('drift-then-kick-misses-half-the-commutator', report%residuals(2), &
                        sqrt(0.5_wp), 4*eps)
        report = order_conditions([1.0_wp], [0.9_wp], drift_first=.true.)
        call t%equal('kicks-that-do-not-sum-to-one-have-order-zero', report%order, 0)
        report = order_conditions(ruth_b, ruth_a, drift_first=.false.)
        call t%equal('ruths-scheme-of-1983-has-order-three', report%order, 3)
        ! Triple jumps: each raises the order of a symmetric scheme by two, whatever A and B.
        steps = 1.0_wp
        n = 1
        do level = 1, 3
            w = 1/(2 - 2.0_wp**(1/(2*level + 1.0_wp)))
            steps(1:3*n) = [w*steps(1:n), (1 - 2*w)*steps(1:n), w*steps(1:n)]
            n = 3*n
            report = order_conditions([steps(1)/2, ((steps(i) + steps(i + 1))/2, i=1, n - 1), steps(n)/2], &
                                      steps(1:n), drift_first=.true., tolerance=1.0e-9_wp)
            call t%equal('triple-jumps-of-strang-have-orders-4-6-8', report%order, 2*level + 2)
        end do

        scheme = splitting_scheme('srkn14')
        a = scheme%drift_coefficients()
        a(4) = a(4) + 3.0e-14_wp        ! the preprint's a_4, with the centre that follows from it
        a(12) = a(4)
        a(8) = a(8) - 6.0e-14_wp
        misprint = splitting_scheme(a, scheme%kick_coefficients())
        call t%ok('the-misprinted-a4-shows-in-the-residuals', residual(misprint) > 10*residual(scheme))
        a(4) = a(4) + 1.0e-9_wp
        a(12) = a(4)
        a(8) = a(8) - 2.0e-9_wp
        misprint = splitting_scheme(a, scheme%kick_coefficients())
        report = misprint%conditions()
        call t%equal('an-error-in-the-ninth-digit-lowers-the-order', report%nystroem_order, 2)
    end subroutine test_conditions

    !> Modified kicks, the third letter of the words: Takahashi and Imada's scheme, whose kick removes the
    !> leading error of kicks.
    subroutine test_modified(t)
        type(tally), intent(inout) :: t
        type(order_report) :: report
        type(splitting_scheme) :: scheme, own
        real(wp), allocatable :: a(:), b(:), c(:)
        integer :: i

        ! Chin's 4A: kick 1/6, drift 1/2, kick 2/3 with c = 1/72, drift 1/2, kick 1/6.
        report = order_conditions([0.5_wp, 0.5_wp], [1/6.0_wp, 2/3.0_wp, 1/6.0_wp], drift_first=.false.)
        call t%equal('chins-scheme-without-its-modified-kick-has-order-two', report%nystroem_order, 2)
        report = order_conditions([0.5_wp, 0.5_wp], [1/6.0_wp, 2/3.0_wp, 1/6.0_wp], drift_first=.false., &
                                  modified=[0.0_wp, 1/72.0_wp, 0.0_wp])
        call t%equal('chins-scheme-has-order-four', report%nystroem_order, 4)
        ! Strang, drift first, is exp(A + B - [A,[A,B]]/24 - [B,[A,B]]/12 + ...): c = 1/12 leaves the words
        ! AAB - 2 ABA + BAA.
        report = order_conditions([0.5_wp, 0.5_wp], [1.0_wp], drift_first=.true., modified=[1/12.0_wp])
        call t%close_to('strang-with-a-modified-kick-misses-one-commutator', report%residuals(3), &
                        sqrt(6.0_wp)/24, 4*eps)
        do i = 10, 13
            scheme = splitting_scheme(trim(scheme_names(i)))
            a = scheme%drift_coefficients()
            b = scheme%kick_coefficients()
            c = scheme%modified_coefficients()
            report = order_conditions(a, b, scheme%drift_first, modified=c*(1 + 1.0e-9_wp))
            call t%equal(trim(scheme_names(i))//'-needs-its-modified-kicks-to-the-ninth-digit', &
                         report%nystroem_order, 2)
            own = splitting_scheme(a, b, c=c, displaced=1)
            call t%ok(trim(scheme_names(i))//'-can-be-made-from-its-coefficients', own%status == status_ok &
                      .and. all(abs(own%modified_coefficients() - c) <= 0.0_wp) .and. own%displaced == 1)
        end do
        own = splitting_scheme(a, b, c=c(2:))
        call t%equal('fewer-modified-kicks-than-kicks-are-refused', own%status, status_bad_scheme)
        c(1) = 2*c(1)
        own = splitting_scheme(a, b, c=c)
        call t%equal('unsymmetric-modified-kicks-are-refused', own%status, status_bad_scheme)
        c = ieee_value(1.0_wp, ieee_quiet_nan)
        own = splitting_scheme(a, b, c=c)
        call t%equal('nan-in-modified-kicks-is-refused', own%status, status_bad_scheme)
        scheme = splitting_scheme('fg6a', displaced=3)
        call t%equal('three-displaced-torques-are-refused', scheme%status, status_bad_option)
    end subroutine test_modified

    !> A user's own coefficients.
    subroutine test_own(t)
        type(tally), intent(inout) :: t
        type(splitting_scheme) :: scheme, own
        type(order_report) :: report

        scheme = splitting_scheme('srkn11')
        own = splitting_scheme(scheme%drift_coefficients(), scheme%kick_coefficients(), 'mine')
        call t%ok('own-scheme-keeps-its-name', own%name == 'mine')
        call t%ok('a-scheme-made-from-the-coefficients-of-another-is-the-other', &
                  own%status == status_ok .and. (own%drift_first .eqv. scheme%drift_first) &
                  .and. own%drifts == scheme%drifts .and. own%kicks == scheme%kicks &
                  .and. all(abs(own%half_a - scheme%half_a) <= 0.0_wp) &
                  .and. all(abs(own%half_b - scheme%half_b) <= 0.0_wp))
        own = splitting_scheme(a=[1.0_wp], b=[0.5_wp, 0.5_wp])
        report = own%conditions()
        call t%ok('kick-drift-kick-is-accepted', own%status == status_ok .and. .not. own%drift_first)
        call t%equal('kick-drift-kick-has-order-two', report%order, 2)
        call t%equal('kick-drift-kick-has-one-stage', own%stages(), 1)
        call t%close_to('an-even-palindrome-is-mirrored-without-a-centre', &
                        mirrored([1.0_wp, 2.0_wp], 4), [1.0_wp, 2.0_wp, 2.0_wp, 1.0_wp], 0.0_wp)
        call t%close_to('an-odd-palindrome-has-its-centre-once', &
                        mirrored([1.0_wp, 2.0_wp], 3), [1.0_wp, 2.0_wp, 1.0_wp], 0.0_wp)
    end subroutine test_own

    !> Each way coefficients can be wrong.
    subroutine test_refused(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: halves(2) = [0.5_wp, 0.5_wp], one(1) = [1.0_wp]
        type(splitting_scheme) :: scheme
        type(order_report) :: report
        real(wp) :: many(most_stages + 1)

        scheme = splitting_scheme('leapfrog')
        call t%equal('unknown-name-is-refused', scheme%status, status_bad_option)
        scheme = splitting_scheme(halves, [0.9_wp])
        call t%equal('kicks-that-do-not-sum-to-one-are-refused', scheme%status, status_bad_scheme)
        scheme = splitting_scheme([0.5_wp, 0.5_wp + 1.0e-11_wp], one)
        call t%equal('drifts-that-do-not-sum-to-one-are-refused', scheme%status, status_bad_scheme)
        scheme = splitting_scheme([0.4_wp, 0.6_wp], one)
        call t%equal('unsymmetric-drifts-are-refused', scheme%status, status_bad_scheme)
        scheme = splitting_scheme(halves, halves)
        call t%equal('as-many-drifts-as-kicks-are-refused', scheme%status, status_bad_scheme)
        scheme = splitting_scheme(one, [real(wp) ::])
        call t%equal('no-kick-is-refused', scheme%status, status_bad_scheme)
        scheme = splitting_scheme(halves, [ieee_value(1.0_wp, ieee_quiet_nan)])
        call t%equal('nan-coefficient-is-refused', scheme%status, status_bad_scheme)
        scheme = splitting_scheme([0.4_wp, 0.4_wp], one, tolerance=ieee_value(1.0_wp, ieee_quiet_nan))
        call t%equal('nan-is-no-tolerance-of-a-sum', scheme%status, status_bad_scheme)
        scheme = splitting_scheme([ieee_value(1.0_wp, ieee_positive_inf), 0.0_wp], one)
        call t%equal('infinite-coefficient-is-refused', scheme%status, status_bad_scheme)
        many = 1/real(most_stages + 1, wp)
        scheme = splitting_scheme(many, many(1:most_stages)*(most_stages + 1)/most_stages)
        call t%equal('too-many-stages-are-refused', scheme%status, status_bad_scheme)
        report = scheme%conditions()
        call t%equal('a-refused-scheme-has-no-coefficients', size(scheme%drift_coefficients()), 0)
        call t%equal('a-refused-scheme-has-order-zero', report%order, 0)
    end subroutine test_refused

    !> Largest residual of the conditions up to order six.
    function residual(scheme)
        type(splitting_scheme), intent(in) :: scheme
        real(wp) :: residual
        type(order_report) :: report

        report = scheme%conditions()
        residual = largest(report%nystroem_residuals(5:6))
    end function residual

    !> The elements of v from last to first.
    pure function reversed(v) result(r)
        real(wp), intent(in) :: v(:)
        real(wp) :: r(size(v))

        r = v(size(v):1:-1)
    end function reversed

end module frb_test_schemes
