!> What a run of a splitting scheme is made of, for one body and for many: the stages multiplied by h, the
!> checks every call has in common, and compensated updates.
module frb_splitting_plan
    use frb_kinds, only: wp
    use frb_schemes, only: splitting_scheme, most_stages
    use frb_status, only: status_ok, status_bad_count, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: timetable, new_timetable, check_run, is_attitude, carry, turn_increments

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

    !> x + increment with the rounding error of the sum carried over to the next one in `rest` (Kahan,
    !> Moeller).
    elemental subroutine carry(x, increment, rest)
        real(wp), intent(inout) :: x
        real(wp), intent(in) :: increment
        real(wp), intent(inout) :: rest     !! what x lacks; 0 at the start
        real(wp) :: whole, new

        whole = increment + rest
        new = x + whole
        rest = whole - (new - x)
        x = new
    end subroutine carry

    !> Increments of m and q by a free motion that turns the body by the unit quaternion r, q(h) = q r. Each
    !> is as accurate as r - 1, that is, far better than the difference of two rounded states when the turn is
    !> small: m is constant in space, so m(h) = E(r)^T m, and r1 - 1 follows from the norm.
    pure subroutine turn_increments(r, m, q, m_increment, q_increment)
        real(wp), intent(in) :: r(4), m(3), q(4)
        real(wp), intent(out) :: m_increment(3), q_increment(4)
        real(wp) :: w, c1, c2, c3

        w = r(1) - 1
        if (r(1) > 0.0_wp) w = -(r(2)*r(2) + r(3)*r(3) + r(4)*r(4))/(1 + r(1))
        ! With c = r x m the increment of m is 2 (r x c - r1 c).
        c1 = 2*(r(3)*m(3) - r(4)*m(2))
        c2 = 2*(r(4)*m(1) - r(2)*m(3))
        c3 = 2*(r(2)*m(2) - r(3)*m(1))
        m_increment(1) = (r(3)*c3 - r(4)*c2) - r(1)*c1
        m_increment(2) = (r(4)*c1 - r(2)*c3) - r(1)*c2
        m_increment(3) = (r(2)*c2 - r(3)*c1) - r(1)*c3
        q_increment(1) = q(1)*w - q(2)*r(2) - q(3)*r(3) - q(4)*r(4)
        q_increment(2) = q(1)*r(2) + q(2)*w + q(3)*r(4) - q(4)*r(3)
        q_increment(3) = q(1)*r(3) + q(3)*w + q(4)*r(2) - q(2)*r(4)
        q_increment(4) = q(1)*r(4) + q(4)*w + q(2)*r(3) - q(3)*r(2)
    end subroutine turn_increments

end module frb_splitting_plan
