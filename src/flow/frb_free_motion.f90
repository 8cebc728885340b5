!> One free motion at many times: `free_motion`, with its period and its precession, constants set up once.
!>
!> After one period T the momentum in the body returns to its start, and the attitude has turned about the
!> momentum, fixed in space, by the angle of precession. So m and q at any time are those at a time within
!> half a period of the start, turned n times; the error of the phase grows with the rounding of T and of the
!> angle only.
module frb_free_motion
    use frb_flow_periods, only: quarter_period
    use frb_free_flow, only: flow_tangent, core_of, free_flow, rigid_body
    use frb_inertia, only: body_core, keep_off_axis, to_principal
    use frb_kinds, only: wp, two_pi
    use frb_rotations, only: norm3, quat_product, quat_rotate
    use frb_status, only: return_or_stop, status_ok, status_bad_attitude, status_bad_count, &
        status_bad_momentum, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_positive_inf, ieee_quiet_nan
    implicit none
    private

    public :: free_motion

    !> A free motion given by its body and its state at t = 0: `motion = free_motion(body, m, q)`.
    !> `status` is not status_ok when the body, m or q was refused; `at` then returns it.
    type :: free_motion
        integer :: status = status_bad_momentum
        logical :: periodic = .false.       !! not on a separatrix or the middle axis, for a sphere, m = 0
        type(rigid_body), private :: body
        real(wp), private :: m0(3) = 0.0_wp
        real(wp), private :: q0(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        real(wp), private :: axis(3) = 0.0_wp       !! direction of the momentum in space
        real(wp), private :: period_of_m = 0.0_wp
        real(wp), private :: half_angle = 0.0_wp    !! half the turn about the momentum in a period
        real(wp), private :: turns_sign = 1.0_wp    !! -1 when q changes sign besides
    contains
        procedure, private :: at_time    !! state at one time
        procedure, private :: at_times    !! states at n times
        generic :: at => at_time, at_times    !! m, and q when present, at t or t(n)
        procedure :: tangent    !! derivative of the state at t by that at 0
        procedure :: period    !! period of m
        procedure :: precession    !! turn about the momentum in it [rad]
        procedure :: precession_period    !! mean time of a turn about the momentum
    end type free_motion

    !> Constants of an orbit in scaled units.
    type :: orbit
        integer :: exponent = 0
        real(wp) :: a(3) = 0.0_wp       !! 1/I, sorted
        real(wp) :: beta = 0.0_wp       !! a(1) - a(3)
        real(wp) :: g = 0.0_wp          !! |m|
        real(wp) :: larger = 0.0_wp     !! max(P, R)
        real(wp) :: delta = 0.0_wp      !! R - P
        real(wp) :: nu_first = 0.0_wp   !! parameter of the third kind, and that of the mirror image
        real(wp) :: nu_mirror = 0.0_wp
        logical :: first_form = .true.
    end type orbit

    !> Sets up a motion from its state at t = 0: `motion = free_motion(body, m, q)`.
    interface free_motion
        module procedure motion_from_state
    end interface free_motion

contains

    !> The motion of `body` that has m and q at t = 0; its `status` says whether they can be used.
    function motion_from_state(body, m, q) result(motion)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: m(3)            !! body angular momentum at t = 0
        real(wp), intent(in) :: q(4)            !! attitude at t = 0; not zero, its norm is kept
        type(free_motion) :: motion
        real(wp) :: largest

        motion%body = body
        motion%status = body%status()
        if (motion%status /= status_ok) return
        if (.not. all(ieee_is_finite(m))) then
            motion%status = status_bad_momentum
        else if (.not. all(ieee_is_finite(q))) then
            motion%status = status_bad_attitude
        else if (maxval(abs(q)) <= 0.0_wp) then
            motion%status = status_bad_attitude
        end if
        if (motion%status /= status_ok) return
        motion%m0 = m
        call keep_off_axis(core_of(body), motion%m0, motion%status)
        if (motion%status /= status_ok) return
        motion%q0 = q
        largest = maxval(abs(m))
        if (largest <= 0.0_wp) return
        motion%axis = m/largest
        motion%axis = motion%axis/norm3(motion%axis)
        motion%axis = quat_rotate(scale(q, -exponent(maxval(abs(q))))/norm4(q), motion%axis)
        call set_up_period(motion)
    end function motion_from_state

    !> Period 4 K(k)/lambda and precession, theta(T) = G T (a1 - beta nu <s^2/(1 + nu s^2)>), or mirrored.
    subroutine set_up_period(motion)
        type(free_motion), intent(inout) :: motion
        type(orbit) :: path
        real(wp) :: nu, quarter, mean
        integer, parameter :: largest_exponent = 900    ! periods beyond 2^900 or under 2^-900 are of no use

        path = orbit_of(motion)
        if (abs(path%delta) <= 0.0_wp) return
        nu = min(path%nu_first, path%nu_mirror)
        call quarter_period(path%larger, abs(path%delta), nu, .true., quarter, mean)
        if (abs(exponent(quarter) - path%exponent) > largest_exponent) return
        motion%periodic = .true.
        if (path%first_form) then
            motion%half_angle = 2*quarter*path%g*(path%a(1) - path%beta*nu*mean)
            motion%turns_sign = merge(1.0_wp, -1.0_wp, path%delta <= 0.0_wp)
        else
            motion%half_angle = 2*quarter*path%g*(path%a(3) + path%beta*nu*mean)
            motion%turns_sign = merge(-1.0_wp, 1.0_wp, path%delta <= 0.0_wp)
        end if
        motion%period_of_m = scale(4*quarter, -path%exponent)
    end subroutine set_up_period

    !> The constants of the motion, momentum and moments scaled by powers of 2, so that no norm is too large
    !> or too small: times are in units of 2^-exponent.
    pure function orbit_of(motion) result(path)
        type(free_motion), intent(in) :: motion
        type(orbit) :: path
        real(wp) :: n(3), alpha, beta, gamma, alpha_t, gamma_t, gg, p, r
        integer :: em, ea

        associate (body => core_of(motion%body))
            n = motion%m0
            if (body%needs_rotation) n = to_principal(body, n)
            em = exponent(maxval(abs(n)))
            ea = exponent(body%a(1))
            n = scale(n(body%order), -em)
            path%a = scale(body%a, -ea)
            alpha = scale(body%alpha, -ea)
            beta = scale(body%beta, -ea)
            gamma = scale(body%gamma, -ea)
        end associate
        path%exponent = em + ea
        ! With t = 1, alpha t is alpha.
        call orbit_constants(alpha, beta, gamma, 1.0_wp, n(1), n(2), n(3), alpha_t, path%beta, gamma_t, gg, &
                             p, r, path%nu_first, path%nu_mirror)
        path%g = sqrt(gg)
        path%larger = max(p, r)
        path%delta = beta*((alpha*n(3)**2) - (gamma*n(1)**2))   ! exactly 0 on the separatrix, with FMA too
        path%first_form = path%nu_first <= path%nu_mirror
    end function orbit_of

    !> m, and q when present, at the time t of either sign.
    subroutine at_time(self, t, m, q, stat)
        class(free_motion), intent(in) :: self
        real(wp), intent(in) :: t                       !! time
        real(wp), intent(out) :: m(3)                   !! body angular momentum at t
        real(wp), intent(out), optional :: q(4)         !! attitude at t
        integer, intent(out), optional :: stat
        integer, parameter :: most_digits = 52
        real(wp), parameter :: splitter = 2.0_wp**27 + 1
        real(wp) :: number, high, rest, angle
        integer :: code

        m = self%m0
        if (present(q)) q = self%q0
        code = self%status
        if (code == status_ok .and. .not. ieee_is_finite(t)) code = status_bad_time
        if (code == status_ok) then
            number = 0.0_wp
            rest = t
            if (self%periodic) then
                if (abs(t) > 0.5_wp*self%period_of_m) then
                    if (exponent(t) - exponent(self%period_of_m) > most_digits) then
                        rest = mod(t, self%period_of_m)     ! no digit of the phase is left
                    else
                        ! Below 2^26 turns number*high is exact: only the rounding of the period is lost.
                        number = anint(t/self%period_of_m)
                        high = self%period_of_m*splitter
                        high = high - (high - self%period_of_m)
                        rest = (t - number*high) - number*(self%period_of_m - high)
                    end if
                end if
            end if
            if (present(q)) then
                call free_flow(self%body, rest, m, q, code)
                if (abs(number) > 0.0_wp) then
                    angle = number*self%half_angle
                    q = quat_product([cos(angle), sin(angle)*self%axis], q)
                    if (self%turns_sign < 0.0_wp .and. abs(mod(number, 2.0_wp)) > 0.5_wp) q = -q
                end if
            else
                call free_flow(self%body, rest, m, code)
            end if
        end if
        call return_or_stop(code, 'free_motion%at', stat)
    end subroutine at_time

    !> m(3, n), and q(4, n) when present, at the n times t. status_bad_count if the sizes do not match.
    !> Refused, the arrays hold the state at t = 0, or zeros if they have not 3 and 4 rows.
    subroutine at_times(self, t, m, q, stat)
        class(free_motion), intent(in) :: self
        real(wp), intent(in) :: t(:)
        real(wp), intent(out) :: m(:, :)
        real(wp), intent(out), optional :: q(:, :)
        integer, intent(out), optional :: stat
        integer :: code, code_here, i

        code = self%status
        if (size(m, 1) /= 3 .or. size(m, 2) /= size(t)) code = status_bad_count
        if (present(q)) then
            if (size(q, 1) /= 4 .or. size(q, 2) /= size(t)) code = status_bad_count
        end if
        if (code /= status_ok) then
            m = 0.0_wp
            if (size(m, 1) == 3) m = spread(self%m0, 2, size(m, 2))
            if (present(q)) then
                q = 0.0_wp
                if (size(q, 1) == 4) q = spread(self%q0, 2, size(q, 2))
            end if
        else
            do i = 1, size(t)
                if (present(q)) then
                    call self%at_time(t(i), m(:, i), q(:, i), code_here)
                else
                    call self%at_time(t(i), m(:, i), stat=code_here)
                end if
                code = max(code, code_here)
            end do
        end if
        call return_or_stop(code, 'free_motion%at', stat)
    end subroutine at_times

    !> The derivative of the state at t by that at t = 0, on (dm, dtheta) as in `flow_tangent`; 1 where `at`
    !> would refuse.
    subroutine tangent(self, t, transition, stat)
        class(free_motion), intent(in) :: self
        real(wp), intent(in) :: t                       !! time
        real(wp), intent(out) :: transition(6, 6)       !! [J 0; W E]
        integer, intent(out), optional :: stat
        real(wp) :: m(3), q(4)
        integer :: code, i

        m = self%m0
        q = self%q0
        code = self%status
        if (code == status_ok) then
            call flow_tangent(self%body, t, m, q, transition, code)
        else
            transition = reshape([(merge(1.0_wp, 0.0_wp, mod(i, 7) == 0), i=0, 35)], [6, 6])
        end if
        call return_or_stop(code, 'free_motion%tangent', stat)
    end subroutine tangent

    !> Period of the momentum in the body; on a stable axis that of small oscillations about it; Inf where
    !> there is none (`periodic` is then .false.).
    pure function period(self) result(time)
        class(free_motion), intent(in) :: self
        real(wp) :: time

        time = ieee_value(1.0_wp, ieee_positive_inf)
        if (self%periodic) time = self%period_of_m
    end function period

    !> Angle about the momentum, right-handed and > 0, by which the axis of least moment (an asteroid's long
    !> axis) goes round in one period, whole turns counted [rad]; modulo 2 pi it is the turn of the body after
    !> a period. The axis of largest moment goes round 2 pi further. A body whose two lesser moments are equal
    !> has its symmetry axis in the place of the long one: the angle is then |m| T/I1. NaN without a period.
    !> Accuracy: 4 epsilon, relative, if the motion itself does not depend on the last digits of the input;
    !> checked by free-motion: precession-agrees-with-25-digits.
    pure function precession(self) result(angle)
        class(free_motion), intent(in) :: self
        real(wp) :: angle

        angle = ieee_value(1.0_wp, ieee_quiet_nan)
        if (self%periodic) angle = whole_angle(self)
    end function precession

    !> Mean time in which the axis of `precession` goes once round the momentum, 2 pi T/angle: the published
    !> P_phi of a tumbling asteroid, while `period` is its P_psi. Inf where there is no period.
    pure function precession_period(self) result(time)
        class(free_motion), intent(in) :: self
        real(wp) :: time

        time = ieee_value(1.0_wp, ieee_positive_inf)
        if (self%periodic) time = two_pi*(self%period_of_m/whole_angle(self))
    end function precession_period

    !> The azimuth of axis 1 of the sorted body about the momentum grows in a period by the mirror form,
    !> G T (a3 + beta <nu s^2/(1 + nu s^2)>), a sum of positive terms; that of axis 3 by the first, 2 pi more.
    pure function whole_angle(motion) result(angle)
        type(free_motion), intent(in) :: motion
        real(wp) :: angle
        real(wp), parameter :: few_halvings = 1024.0_wp
        type(orbit) :: path
        real(wp) :: quarter, mean

        path = orbit_of(motion)
        angle = 2*motion%half_angle
        if (lesser_moments_are_equal(core_of(motion%body))) then
            if (.not. path%first_form) angle = angle + two_pi
        else if (path%first_form) then
            if (path%nu_mirror > few_halvings*path%larger) then
                angle = angle - two_pi      ! a long period: the angle is many turns, nothing cancels
            else
                call quarter_period(path%larger, abs(path%delta), path%nu_mirror, .true., quarter, mean)
                angle = 4*quarter*path%g*(path%a(3) + path%beta*path%nu_mirror*mean)
            end if
        end if
    end function whole_angle

    !> Equal as they were given, or within the rounding of a tensor's moments, some units of the largest one.
    pure function lesser_moments_are_equal(body) result(equal)
        type(body_core), intent(in) :: body
        logical :: equal
        real(wp), parameter :: rounding_of_tensors = 8*epsilon(1.0_wp)
        real(wp) :: moments(3)

        moments = body%moments(body%order)
        equal = moments(2) - moments(1) <= merge(rounding_of_tensors*moments(3), 0.0_wp, body%needs_rotation)
    end function lesser_moments_are_equal

    !> Norm of a quaternion scaled to the middle of the exponents.
    pure function norm4(q) result(norm)
        real(wp), intent(in) :: q(4)
        real(wp) :: norm

        norm = sqrt(sum(scale(q, -exponent(maxval(abs(q))))**2))
    end function norm4

    include 'orbit_formulas.inc'

end module frb_free_motion
