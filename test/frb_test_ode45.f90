!> The two steps against Octave's ode45, as in section 4.1 of the paper; data/ode45 has the table.
module frb_test_ode45
    use frb_checks, only: tally, worst_of
    use frb_flow_samples, only: no_turn
    use frb_kinds, only: wp
    use frb_matrix_step, only: frb_step
    use frb_quat_step, only: quat_step
    use frb_rotations, only: norm3, quat_to_matrix
    implicit none
    private

    public :: test_ode45

    !> The table itself is good to 6e-15, 27 units of epsilon; a matrix shows the error of a quaternion twice.
    real(wp), parameter :: tolerance = 40*epsilon(1.0_wp)

    integer, parameter :: cases = 60

contains

    subroutine test_ode45(t)
        type(tally), intent(inout) :: t
        real(wp) :: row(14), m(3), attitude(3, 3), q(4), worst(4)
        integer :: unit, io, count, stat, failures

        worst = 0.0_wp
        count = 0
        failures = 0
        open (newunit=unit, file='data/ode45/cases.txt', status='old', action='read')
        do
            read (unit, *, iostat=io) row
            if (io /= 0) exit
            count = count + 1
            m = 0.0_wp
            attitude = 0.0_wp
            call frb_step(m, attitude, row(7), row(1:3), row(4:6), quat_to_matrix(no_turn), stat=stat)
            if (stat /= 0) failures = failures + 1
            worst(1) = worst_of(worst(1), norm3(m - row(8:10))/norm3(row(4:6)))
            worst(2) = worst_of(worst(2), [abs(attitude - quat_to_matrix(row(11:14)))])
            q = 0.0_wp
            call quat_step(m, q, row(7), row(1:3), row(4:6), no_turn, stat=stat)
            if (stat /= 0) failures = failures + 1
            worst(3) = worst_of(worst(3), norm3(m - row(8:10))/norm3(row(4:6)))
            ! With its sign: the quaternion of the continuous motion from q(0) = 1.
            worst(4) = worst_of(worst(4), [abs(q - row(11:14))])
        end do
        close (unit)

        call t%open_suite('ode45', 6)
        call t%equal('every-case-of-the-table-is-read', count, cases)
        call t%equal('every-case-is-accepted', failures, 0)
        call t%at_most('matrix-step-has-the-momentum-of-ode45', worst(1), tolerance)
        call t%at_most('matrix-step-has-the-attitude-of-ode45', worst(2), 2*tolerance)
        call t%at_most('quaternion-step-has-the-momentum-of-ode45', worst(3), tolerance)
        call t%at_most('quaternion-step-has-the-attitude-of-ode45', worst(4), tolerance)
        call t%close_suite()
    end subroutine test_ode45

end module frb_test_ode45
