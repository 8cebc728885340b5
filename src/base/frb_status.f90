!> Errors as values: named status codes, and the one routine that hands a code to the caller or stops.
!>
!> Every public procedure that can refuse its input has a last, optional argument `stat`. Present, it
!> receives one of the codes below and nothing is printed. Absent, a code other than `status_ok` and
!> `status_stopped` ends the program by `error stop 1`, with exit code 1. Standard error then gets the line
!> `routine: message`, and after it what the compiler writes at every `error stop`: gfortran writes
!> `ERROR STOP 1` and the calls that led there (no calls when built with -fno-backtrace). Refused input leaves
!> in-place arguments untouched and copies input to output elsewhere, so nothing is ever left unset.
module frb_status
    use, intrinsic :: iso_fortran_env, only: error_unit
    implicit none
    private

    public :: return_or_stop, status_message
    public :: status_ok, status_bad_moments, status_bad_tensor, status_bad_momentum, status_bad_attitude
    public :: status_bad_time, status_bad_count, status_bad_option, status_bad_torque, status_bad_scheme
    public :: status_no_period, status_lapack_failed, status_stopped, status_not_offered
    public :: status_too_rough

    integer, parameter :: status_ok = 0             !! done
    integer, parameter :: status_bad_moments = 1    !! moments not finite and positive, nor a linear rotor's
    integer, parameter :: status_bad_tensor = 2     !! inertia tensor not finite, symmetric, positive definite
    integer, parameter :: status_bad_momentum = 3   !! angular momentum is not finite, or along a rotor's axis
    integer, parameter :: status_bad_attitude = 4   !! attitude is not finite, or a quaternion of norm zero
    integer, parameter :: status_bad_time = 5       !! time or step is not finite, or zero where it may not be
    integer, parameter :: status_bad_count = 6      !! a number of bodies, points, steps or a size is wrong
    integer, parameter :: status_bad_option = 7     !! an option has none of its permitted values
    integer, parameter :: status_bad_torque = 8     !! a torque or potential returned NaN or Inf
    integer, parameter :: status_bad_scheme = 9     !! coefficients do not sum to one, or are not symmetric
    integer, parameter :: status_no_period = 10     !! the motion has no period (a separatrix)
    integer, parameter :: status_lapack_failed = 11 !! an eigensolver of LAPACK did not converge
    integer, parameter :: status_stopped = 12       !! an observer ended the run
    integer, parameter :: status_not_offered = 13   !! a scene does not provide this quantity
    integer, parameter :: status_too_rough = 14     !! a torque is too rough for the tolerance

contains

    !> Hands `code` to the caller when `stat` is present; otherwise stops if it says that something is wrong.
    subroutine return_or_stop(code, place, stat)
        integer, intent(in) :: code             !! one of the codes of this module
        character(*), intent(in) :: place       !! name of the routine that returns or stops
        integer, intent(out), optional :: stat  !! receives `code`

        if (present(stat)) then
            stat = code
        else if (code /= status_ok .and. code /= status_stopped) then
            write (error_unit, '(a)') place//': '//status_message(code)
            ! Before the compiler's own words, which do not wait in a buffer.
            flush (error_unit)
            error stop 1
        end if
    end subroutine return_or_stop

    !> One line that says what a status code means.
    pure function status_message(code) result(message)
        integer, intent(in) :: code
        character(:), allocatable :: message

        select case (code)
        case (status_ok)
            message = 'no error'
        case (status_bad_moments)
            message = 'moments of inertia must be finite and positive, or those of a linear rotor'
        case (status_bad_tensor)
            message = 'the inertia tensor must be finite, symmetric and positive definite, or that of a '// &
                      'linear rotor'
        case (status_bad_momentum)
            message = 'the angular momentum must be finite, and zero along the axis of a linear rotor'
        case (status_bad_attitude)
            message = 'the attitude must be finite, a quaternion of nonzero norm'
        case (status_bad_time)
            message = 'the time or step must be finite, and a step that divides must not be zero'
        case (status_bad_count)
            message = 'a count or an array size is out of range or does not match the others'
        case (status_bad_option)
            message = 'an option has none of its permitted values'
        case (status_bad_torque)
            message = 'the torque or the potential is not finite'
        case (status_bad_scheme)
            message = 'the coefficients of the scheme must be finite, symmetric and sum to one'
        case (status_no_period)
            message = 'the motion has no period'
        case (status_lapack_failed)
            message = 'the eigensolver of LAPACK did not converge'
        case (status_not_offered)
            message = 'the scene does not provide this quantity'
        case (status_too_rough)
            message = 'the torque is too rough for the tolerance'
        case (status_stopped)
            message = 'an observer ended the run'
        case default
            message = 'unknown status code'
        end select
    end function status_message

end module frb_status
