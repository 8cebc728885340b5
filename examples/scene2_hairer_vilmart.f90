!> The heavy top of Hairer and Vilmart (2006): unit weight, centre of mass on axis 3, V = Q_33; an asymmetric
!> body and a flat one, like a water molecule. Halving the step shows the order of each scheme; `extrapolate`
!> chooses its steps by a tolerance.
program scene2_hairer_vilmart
    use frb, only: wp, rigid_body, heavy_top, splitting_scheme, scheme_names, integrate, &
        extrapolate
    implicit none
    real(wp), parameter :: moments(3, 2) = reshape([0.6_wp, 0.8_wp, 1.0_wp, &
                                                    0.345_wp, 0.653_wp, 1.0_wp], [3, 2])
    character(10), parameter :: names(2) = ['asymmetric', 'flat      ']
    type(splitting_scheme) :: scheme
    type(heavy_top) :: top
    real(wp) :: m(3), q(4), m_fine(3), q_fine(4), error(2)
    integer :: i, j, n

    do i = 1, 2
        call run('srkn14', 1000, m_fine, q_fine)
        print '(a,3f9.5)', names(i)//'  m(10) = ', m_fine
        do j = 1, size(scheme_names)
            do n = 1, 2
                call run(trim(scheme_names(j)), 60*n, m, q)
                error(n) = max(maxval(abs(m - m_fine)), maxval(abs(q - q_fine)))
            end do
            print '(2x,a,2(a,es8.1),a,f4.1)', scheme_names(j), '  h = 1/6:', error(1), &
                '  h = 1/12:', error(2), '  quotient 2 to the', log(error(1)/error(2))/log(2.0_wp)
        end do
        call start(m, q)
        call extrapolate(rigid_body(moments(:, i)), top, 10.0_wp, m, q, tolerance=1.0e-8_wp)
        error(1) = max(maxval(abs(m - m_fine)), maxval(abs(q - q_fine)))
        print '(2x,a,es7.0)', 'extrapolate, tolerance 1e-8: error below', 10.0_wp**ceiling(log10(error(1)))
    end do

contains

    !> Ten units of time in steps of h = 10/steps.
    subroutine run(name, steps, m, q)
        character(*), intent(in) :: name
        integer, intent(in) :: steps
        real(wp), intent(out) :: m(3), q(4)

        call start(m, q)
        scheme = splitting_scheme(name)
        call integrate(rigid_body(moments(:, i)), scheme, top, 10.0_wp/steps, steps, m, q)
    end subroutine run

    subroutine start(m, q)
        real(wp), intent(out) :: m(3), q(4)

        m = [1.8_wp, 0.4_wp, -0.9_wp]
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    end subroutine start

end program scene2_hairer_vilmart

! Output:
!   asymmetric  m(10) =   1.92257  0.77202 -0.20111
!     strang    h = 1/6: 1.8E-02  h = 1/12: 4.5E-03  quotient 2 to the 2.0
!     yoshida4  h = 1/6: 8.1E-04  h = 1/12: 5.1E-05  quotient 2 to the 4.0
!     srkn6     h = 1/6: 1.3E-07  h = 1/12: 8.0E-09  quotient 2 to the 4.0
!     s6        h = 1/6: 6.2E-06  h = 1/12: 3.9E-07  quotient 2 to the 4.0
!     srkn11    h = 1/6: 5.1E-09  h = 1/12: 8.1E-11  quotient 2 to the 6.0
!     srkn14    h = 1/6: 2.4E-10  h = 1/12: 3.7E-12  quotient 2 to the 6.0
!     srkn17    h = 1/6: 2.9E-10  h = 1/12: 1.2E-12  quotient 2 to the 8.0
!     aba864    h = 1/6: 4.7E-08  h = 1/12: 7.7E-10  quotient 2 to the 5.9
!     aba1064   h = 1/6: 1.8E-08  h = 1/12: 4.1E-10  quotient 2 to the 5.4
!     fg4       h = 1/6: 2.5E-07  h = 1/12: 1.5E-08  quotient 2 to the 4.1
!     fg6a      h = 1/6: 1.5E-08  h = 1/12: 2.3E-10  quotient 2 to the 6.0
!     fg6b      h = 1/6: 1.7E-07  h = 1/12: 2.7E-09  quotient 2 to the 6.0
!     fg8       h = 1/6: 1.1E-10  h = 1/12: 3.9E-13  quotient 2 to the 8.1
!     extrapolate, tolerance 1e-8: error below 1.E-07
!   flat        m(10) =   1.91238  1.39272  0.93528
!     strang    h = 1/6: 9.8E-02  h = 1/12: 2.5E-02  quotient 2 to the 2.0
!     yoshida4  h = 1/6: 5.6E-03  h = 1/12: 3.4E-04  quotient 2 to the 4.0
!     srkn6     h = 1/6: 4.4E-06  h = 1/12: 1.3E-07  quotient 2 to the 5.1
!     s6        h = 1/6: 8.7E-05  h = 1/12: 5.4E-06  quotient 2 to the 4.0
!     srkn11    h = 1/6: 9.0E-08  h = 1/12: 1.4E-09  quotient 2 to the 6.0
!     srkn14    h = 1/6: 9.9E-09  h = 1/12: 1.4E-10  quotient 2 to the 6.1
!     srkn17    h = 1/6: 9.0E-09  h = 1/12: 3.6E-11  quotient 2 to the 8.0
!     aba864    h = 1/6: 5.8E-07  h = 1/12: 1.0E-08  quotient 2 to the 5.9
!     aba1064   h = 1/6: 1.8E-07  h = 1/12: 4.4E-09  quotient 2 to the 5.3
!     fg4       h = 1/6: 3.1E-06  h = 1/12: 2.6E-07  quotient 2 to the 3.6
!     fg6a      h = 1/6: 2.0E-07  h = 1/12: 2.7E-09  quotient 2 to the 6.2
!     fg6b      h = 1/6: 5.5E-06  h = 1/12: 8.4E-08  quotient 2 to the 6.0
!     fg8       h = 1/6: 1.2E-08  h = 1/12: 4.4E-11  quotient 2 to the 8.1
!     extrapolate, tolerance 1e-8: error below 1.E-07
