!> `extrapolate`: end values by Taylor series, torques of every kind, bodies in any axes.
module frb_test_extrapolate_torques
    use frb_checks, only: tally
    use frb_extrapolation, only: extrapolate, extrapolation_report
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use frb_rotations, only: quat_conjugate, quat_product, quat_rotate, quat_to_matrix
    use frb_scenes, only: heavy_top
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    use frb_status, only: status_ok, status_bad_momentum, status_bad_torque, status_too_rough
    use frb_torque, only: body_scene
    use frb_torque_cases, only: top_case, known_top, distance, pulsed_torque, spoilt_torque, turning_top
    implicit none
    private

    public :: test_extrapolate_torques

    !> A heavy top with a scalar torque alone, which may begin at some time, and refuse with a code of its own
    !> from some time on.
    type, extends(body_scene) :: scalar_top
        type(heavy_top) :: top
        real(wp) :: from = -huge(1.0_wp), until = huge(1.0_wp)
        integer :: refusal = 0
        integer :: asked = 0
    contains
        procedure :: torque => scalar_torque
    end type scalar_top

    !> Torque 1 about axis 3 from a time on.
    type, extends(body_scene) :: switched_torque
        real(wp) :: from = 0.0_wp
    contains
        procedure :: torque => switched
    end type switched_torque

    !> Torques at random: no smooth function of the attitude or the time.
    type, extends(body_scene) :: noisy_torque
        integer :: state = 1
    contains
        procedure :: torque => noise
    end type noisy_torque

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_extrapolate_torques(t)
        type(tally), intent(inout) :: t

        call t%open_suite('extrapolate-torques', 51)
        call test_values(t)
        call test_torques(t)
        call test_bad_torques(t)
        call test_axes(t)
        call t%close_suite()
    end subroutine test_extrapolate_torques

    !> End values by Taylor series; in lanes and torque by torque.
    subroutine test_values(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(scalar_top) :: scalar
        type(extrapolation_report) :: report, other
        real(wp) :: m(3), q(4), m_other(3), q_other(4), error
        character(1) :: digit
        integer :: i, k

        do i = 1, 3
            item = known_top(i)
            write (digit, '(i0)') i
            do k = 2, 7
                m = item%m0
                q = item%q0
                call extrapolate(item%body, item%top, item%t, m, q, 10.0_wp**(-2*k), report=report)
                error = distance(m, q, item%m, item%q)
                call t%at_most('top-'//digit//'-ends-where-the-taylor-series-does', error, &
                               30*10.0_wp**(-2*k) + 5.0e-12_wp)
            end do
            call t%at_most('estimates-of-top-'//digit//'-stay-below-the-tolerance', report%largest_error, &
                           report%tolerance)
            call t%equal('torques-of-top-'//digit//'-are-counted', int(report%torques), &
                         int(report%steps + 48*(report%steps + report%rejected)) + merge(0, 1, i == 1))
            scalar%top = item%top
            m_other = item%m0
            q_other = item%q0
            call extrapolate(item%body, scalar, item%t, m_other, q_other, 1.0e-14_wp, report=other)
            call t%at_most('top-'//digit//'-is-the-same-torque-by-torque', distance(m, q, m_other, q_other), &
                           200*eps)
            call t%ok('top-'//digit//'-takes-the-same-steps-torque-by-torque', &
                      other%steps == report%steps .and. other%rejected == report%rejected)
        end do
    end subroutine test_values

    !> Torques that depend on time, that turn, or are switched on.
    subroutine test_torques(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(pulsed_torque) :: pulse
        type(switched_torque) :: switch
        type(turning_top) :: turning
        type(scalar_top) :: late
        type(rigid_body) :: body
        type(extrapolation_report) :: report
        real(wp) :: m(3), q(4), m_ref(3), q_ref(4), time, angle, error(2), order
        integer, parameter :: steps(2) = [5, 7]
        integer :: i, stat

        ! About axis 3 alone, see frb_test_splitting.
        body = rigid_body([1.0_wp, 1.5_wp, 2.0_wp])
        time = 1.0_wp
        m = [0.0_wp, 0.0_wp, sin(1.0_wp)]
        angle = cos(1.0_wp)/2
        q = [cos(angle/2), 0.0_wp, 0.0_wp, -sin(angle/2)]
        call extrapolate(body, pulse, 5.0_wp, m, q, 1.0e-12_wp, t=time)
        angle = -cos(6.0_wp)/2
        call t%at_most('a-torque-of-time-is-asked-at-the-times-of-each-sequence', &
                       distance(m, q, [0.0_wp, 0.0_wp, sin(6.0_wp)], &
                                [cos(angle/2), 0.0_wp, 0.0_wp, sin(angle/2)]), 1.0e-12_wp)
        item = known_top(2)
        m_ref = item%m0
        q_ref = item%q0
        time = 1.0_wp
        call integrate(item%body, splitting_scheme('srkn17'), turning, 0.01_wp, 500, m_ref, q_ref, t=time, &
                       compensated=.true.)
        do i = 1, 2
            m = item%m0
            q = item%q0
            time = 1.0_wp
            call extrapolate(item%body, turning, 5.0_wp, m, q, 1.0e-9_wp, t=time, step=5.0_wp/steps(i))
            error(i) = distance(m, q, m_ref, q_ref)
        end do
        order = log(error(1)/error(2))/log(real(steps(2), wp)/steps(1))
        call t%ok('order-is-kept-where-the-force-turns', order > 12.0_wp)

        ! m3 = max(0, t - from), angle = m3^2/(2 I3).
        switch%from = 0.3717_wp
        m = 0.0_wp
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call extrapolate(body, switch, 3.0_wp, m, q, 1.0e-9_wp, stat=stat, report=report)
        angle = (3.0_wp - switch%from)**2/4
        call t%at_most('a-torque-that-is-switched-on-is-found', &
                       distance(m, q, [0.0_wp, 0.0_wp, 3.0_wp - switch%from], &
                                [cos(angle/2), 0.0_wp, 0.0_wp, sin(angle/2)]), 1.0e-8_wp)
        call t%ok('a-torque-that-is-switched-on-costs-some-steps', stat == status_ok &
                  .and. report%steps + report%rejected < 200)
        late%top = item%top
        late%from = 5.0_wp
        m = item%m0
        q = item%q0
        call extrapolate(item%body, late, 1.0e4_wp, m, q, 1.0e-9_wp, stat=stat)
        call t%equal('a-torque-that-begins-late-is-not-too-rough', stat, status_ok)
    end subroutine test_torques

    !> Torques that are NaN, refused, or noise.
    subroutine test_bad_torques(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(spoilt_torque) :: spoilt
        type(noisy_torque) :: noisy
        type(scalar_top) :: refusing
        type(rigid_body) :: body
        real(wp) :: m(3), q(4), time
        integer :: stat

        body = rigid_body([1.0_wp, 1.5_wp, 2.0_wp])
        item = known_top(2)
        spoilt%until = 0.7_wp
        m = [1.0_wp, 0.5_wp, 0.2_wp]
        q = item%q0
        time = 0.0_wp
        call extrapolate(body, spoilt, 3.0_wp, m, q, 1.0e-9_wp, t=time, stat=stat)
        call t%equal('a-nan-torque-ends-the-run', stat, status_bad_torque)
        call t%close_to('and-leaves-the-time-up-to-which-there-was-none', time, 0.7_wp, 1.0e-9_wp)
        spoilt%until = -1.0_wp
        call extrapolate(body, spoilt, 3.0_wp, m, q, 1.0e-9_wp, stat=stat)
        call t%equal('a-torque-that-is-always-nan-ends-the-run', stat, status_bad_torque)
        refusing%top = item%top
        refusing%until = 1.0_wp
        refusing%refusal = 77
        m = item%m0
        time = 0.0_wp
        call extrapolate(item%body, refusing, 3.0_wp, m, q, 1.0e-9_wp, t=time, stat=stat)
        call t%ok('a-torque-that-refuses-ends-the-run-with-its-code', stat == 77 .and. time <= 1.0_wp)
        m = [1.0_wp, 0.5_wp, 0.2_wp]
        call extrapolate(body, noisy, 3.0_wp, m, q, 1.0e-12_wp, stat=stat)
        call t%equal('a-torque-without-rhyme-or-reason-is-refused', stat, status_too_rough)
        m = [1.0_wp, 0.5_wp, 0.2_wp]
        call extrapolate(body, noisy, 3.0_wp, m, q, 0.1_wp, stat=stat)
        call t%ok('or-taken-at-a-loose-tolerance', stat == status_ok .or. stat == status_too_rough)
    end subroutine test_bad_torques

    !> Bodies by tensor and linear rotors.
    subroutine test_axes(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: axes(4) = [0.5_wp, 0.1_wp, -0.7_wp, 0.5_wp]
        integer, parameter :: orders(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, 2, 1, 3, 1, 3, 2, 3, 2, 1], &
                                                     [3, 6])
        type(top_case) :: item
        type(scalar_top) :: top
        type(rigid_body) :: body
        real(wp) :: rotation(3, 3), tensor(3, 3), moments(3), m(3), q(4), m_ref(3), q_ref(4)
        integer :: i, stat

        item = known_top(2)
        rotation = quat_to_matrix(axes)
        tensor = 0.0_wp
        do i = 1, 3
            tensor(i, i) = 0.6_wp + 0.2_wp*(i - 1)
        end do
        tensor = matmul(rotation, matmul(tensor, transpose(rotation)))
        top%top = heavy_top(force=item%top%force, centre=quat_rotate(axes, item%top%centre))
        m = quat_rotate(axes, item%m0)
        q = quat_product(item%q0, quat_conjugate(axes))
        call extrapolate(rigid_body(0.5_wp*(tensor + transpose(tensor))), top, item%t, m, q, 1.0e-12_wp)
        m = quat_rotate(quat_conjugate(axes), m)
        q = quat_product(q, axes)
        call t%at_most('a-body-by-tensor-moves-as-in-its-own-axes', distance(m, q, item%m, item%q), &
                       1.0e-10_wp)

        ! Moments in every order, both forms of the turn.
        do i = 1, 6
            moments = [0.6_wp, 0.8_wp, 1.0_wp]
            body = rigid_body(moments(orders(:, i)))
            m = [1.8_wp, 0.4_wp, -0.9_wp]
            q = [0.5_wp, 0.5_wp, -0.5_wp, 0.5_wp]
            m_ref = m
            q_ref = q
            call extrapolate(body, item%top, 3.0_wp, m, q, 1.0e-12_wp)
            call integrate(body, splitting_scheme('srkn17'), item%top, 0.02_wp, 150, m_ref, q_ref)
            call t%at_most('moments-in-any-order', distance(m, q, m_ref, q_ref), 1.0e-10_wp)
        end do

        body = rigid_body([0.0_wp, 0.8_wp, 0.8_wp])
        top%top = heavy_top(centre=[1.0_wp, 0.0_wp, 0.0_wp])
        m = [0.0_wp, 0.4_wp, -0.9_wp]
        m_ref = m
        q_ref = q
        call extrapolate(body, top, 3.0_wp, m, q, 1.0e-12_wp, stat=stat)
        call integrate(body, splitting_scheme('srkn17'), top, 0.02_wp, 150, m_ref, q_ref)
        call t%equal('a-linear-rotor-is-taken', stat, status_ok)
        call t%at_most('a-linear-rotor-moves-as-by-splitting', distance(m, q, m_ref, q_ref), 1.0e-10_wp)
        top%top = heavy_top(centre=[0.0_wp, 1.0_wp, 0.0_wp])
        call extrapolate(body, top, 3.0_wp, m, q, 1.0e-12_wp, stat=stat)
        call t%equal('a-torque-about-the-axis-of-a-linear-rotor-is-refused', stat, status_bad_momentum)
    end subroutine test_axes

    subroutine scalar_torque(self, q, t, tau, stat)
        class(scalar_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        self%asked = self%asked + 1
        call self%top%torque(q, t, tau, stat)
        if (t < self%from) tau = 0.0_wp
        if (t > self%until) stat = self%refusal
    end subroutine scalar_torque

    subroutine switched(self, q, t, tau, stat)
        class(switched_torque), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        associate (unused => q)
        end associate
        tau = [0.0_wp, 0.0_wp, merge(1.0_wp, 0.0_wp, t >= self%from)]
        stat = status_ok
    end subroutine switched

    subroutine noise(self, q, t, tau, stat)
        class(noisy_torque), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat
        integer :: j

        associate (unused_q => q, unused_t => t)
        end associate
        do j = 1, 3
            self%state = mod(self%state*197, 10007)
            tau(j) = self%state/5003.0_wp - 1
        end do
        stat = status_ok
    end subroutine noise

end module frb_test_extrapolate_torques
