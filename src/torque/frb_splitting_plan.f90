!> What a run of a splitting scheme is made of, for one body and for many: the stages multiplied by h, and
!> the checks every call has in common.
module frb_splitting_plan
    use frb_kinds, only: wp
    use frb_schemes, only: splitting_scheme, most_stages
    use frb_status, only: status_ok, status_bad_count, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: timetable, new_timetable, check_run, is_attitude

    !> The stages of a chain of steps, multiplied by h. Within a step come drift(i), the torque at time(i),
    !> kick(i), without the first drift (ABA) or the last kick (BAB): that is the outer stage, shared by two
    !> steps.
    type :: timetable
        integer :: stages = 0                   ! torque evaluations per step
        logical :: drift_first = .true.         ! ABA: the outer stage is a drift
        real(wp) :: drift(most_stages) = 0.0_wp
        real(wp) :: kick(most_stages) = 0.0_wp
        real(wp) :: time(most_stages) = 0.0_wp  ! of each torque, from the start of the step
        real(wp) :: outer = 0.0_wp              ! outer stage at the start of the run and where it ends
        real(wp) :: joint = 0.0_wp              ! outer stage between two steps
        real(wp) :: largest_torque = 0.0_wp     ! of a torque whose kicks do not overflow
        logical :: compensated = .false.
    end type timetable

contains

    !> The scheme's stages for steps of size h.
    pure function new_timetable(scheme, h, compensated) result(table)
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        logical, intent(in), optional :: compensated
        type(timetable) :: table
        real(wp) :: a(scheme%drifts), b(scheme%kicks)
        integer :: i, s

        a = scheme%drift_coefficients()
        b = scheme%kick_coefficients()
        s = scheme%stages()
        table%stages = s
        if (present(compensated)) table%compensated = compensated
        table%drift_first = scheme%drift_first
        table%time(1:s) = [(sum(a(1:i))*h, i=1, s)]
        if (scheme%drift_first) then
            table%outer = a(1)*h
            table%joint = 2*a(1)*h
            table%drift(2:s) = a(2:s)*h
            table%kick(1:s) = b*h
        else
            table%outer = b(1)*h
            table%joint = 2*b(1)*h
            table%drift(1:s) = a*h
            table%kick(1:s - 1) = b(2:s)*h
            table%time(s) = h
        end if
        table%largest_torque = 0.1_wp*huge(h)/max(1.0_wp, maxval(abs(table%kick)), abs(table%joint))
    end function new_timetable

    !> What is common to every call: first thing that is wrong, and defaults.
    pure subroutine check_run(body_status, scheme, h, nsteps, spacing, start, code, every, t)
        integer, intent(in) :: body_status
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        integer, intent(in) :: nsteps
        integer, intent(out) :: spacing
        real(wp), intent(out) :: start
        integer, intent(out) :: code
        integer, intent(in), optional :: every
        real(wp), intent(in), optional :: t
        real(wp), parameter :: longest = 1.0e-7_wp*huge(1.0_wp)  ! coefficients are at most 1e6

        spacing = 1
        if (present(every)) spacing = every
        start = 0.0_wp
        if (present(t)) start = t
        code = body_status
        if (code == status_ok) code = scheme%status
        if (code == status_ok .and. (nsteps < 0 .or. spacing < 1)) code = status_bad_count
        if (code == status_ok) then
            code = status_bad_time
            if (ieee_is_finite(h) .and. ieee_is_finite(start)) then
                if (abs(h) > 0.0_wp .and. abs(h) <= longest/max(nsteps, 1) .and. abs(start) <= longest) then
                    code = status_ok
                end if
            end if
        end if
    end subroutine check_run

    !> Whether q can stand for an attitude: finite and not zero.
    pure function is_attitude(q) result(good)
        real(wp), intent(in) :: q(4)
        logical :: good

        good = all(ieee_is_finite(q))
        if (good) good = any(abs(q) > 0.0_wp)
    end function is_attitude

end module frb_splitting_plan
