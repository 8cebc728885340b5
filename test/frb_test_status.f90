!> Errors: every code has its own message, and a routine that stops without `stat` writes the right line.
module frb_test_status
    use frb_checks, only: tally
    use frb_kinds, only: wp
    use frb_quat_step, only: quat_step
    use frb_status, only: status_bad_moments, status_message
    implicit none
    private

    public :: test_status, stop_in_the_library

contains

    subroutine test_status(t)
        type(tally), intent(inout) :: t

        call t%open_suite('status', 6)
        call check_messages(t)
        call check_stop(t)
        call t%close_suite()
    end subroutine test_status

    !> The codes are those the source declares, so that a new one cannot be left out.
    subroutine check_messages(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: declares = 'integer, parameter :: status_', unknown = 'unknown status code'
        character(200) :: line
        character(100), allocatable :: messages(:)
        integer :: unit, io, code, equals

        allocate (messages(0))
        open (newunit=unit, file='src/base/frb_status.f90', status='old', action='read')
        do
            read (unit, '(a)', iostat=io) line
            if (io /= 0) exit
            equals = index(line, ' = ')
            if (index(adjustl(line), declares) /= 1 .or. equals == 0) cycle
            read (line(equals + 3:), *) code
            messages = [character(100) :: messages, status_message(code)]
        end do
        close (unit)
        call t%ok('the-codes-are-found-in-the-source', size(messages) > status_bad_moments)
        call t%ok('every-status-has-a-message', all(messages /= unknown .and. messages /= ''))
        call t%ok('every-message-is-of-one-status', all([(count(messages == messages(code)) == 1, &
                                                          code=1, size(messages))]))
        call t%ok('another-code-is-unknown', status_message(-1) == unknown &
                  .and. status_message(huge(1)) == unknown)
    end subroutine check_messages

    !> This program again, with the suite `--stop` alone: a routine without `stat` stops in it.
    subroutine check_stop(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: expected = 'quat_step: '
        character(500) :: program, line
        integer :: unit, io, code, command_code

        call get_command_argument(0, program)
        call execute_command_line("'"//trim(program)//"' --stop >build/stop.out 2>build/stop.err", &
                                  exitstat=code, cmdstat=command_code)
        call t%equal('without-stat-the-exit-code-is-1', code, 1)
        open (newunit=unit, file='build/stop.err', status='old', action='read')
        read (unit, '(a)', iostat=io) line
        close (unit)
        call t%ok('without-stat-the-routine-and-the-message-are-printed', io == 0 &
                  .and. line == expected//status_message(status_bad_moments))
    end subroutine check_stop

    !> A suite in which the library stops. Its one check is never made.
    subroutine stop_in_the_library(t)
        type(tally), intent(inout) :: t
        real(wp) :: m(3), q(4)

        call t%open_suite('--stop', 1)
        call quat_step(m, q, 1.0_wp, [0.0_wp, 1.0_wp, 1.0_wp], [1.0_wp, 0.0_wp, 0.0_wp], &
                       [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
        call t%ok('a-routine-without-stat-stops', .false.)
        call t%close_suite()
    end subroutine stop_in_the_library

end module frb_test_status
