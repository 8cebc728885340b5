!> Scenes, observers and drifts for the suites of the torque layer, and tops with known end values.
module frb_torque_cases
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp
    use frb_rotations, only: cross, quat_conjugate, quat_product, quat_rotate
    use frb_scenes, only: heavy_top
    use frb_status, only: status_ok, status_bad_option
    use frb_torque, only: body_scene, group_scene, body_observer, group_observer, body_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: top_case, known_top, papers_m_after_one_step, papers_m_at_5000, start_of_group, distance, &
        fitted_change, recorder, group_recorder, pulsed_torque, spoilt_torque, plain_drift, failing_drift, &
        tilting_drift, turning_top, dipoles, many_tops

    !> Momentum of the paper's top after one step of 0.5 by its scheme and at t = 5000, as the paper published
    !> them; the published run used a misprinted a_4, which shows from about 1e-8 on.
    real(wp), parameter :: papers_m_after_one_step(3) = [-0.3915152739603944_wp, -0.0790616195912371_wp, &
                                                         -0.9166557171043519_wp]
    real(wp), parameter :: papers_m_at_5000(3) = [0.0659419922367005_wp, 0.3964036062397627_wp, &
                                                  -0.9151821877825491_wp]

    !> A heavy top with its start and its end after the time t, to 25 digits (data/reference/make_tops.py).
    type :: top_case
        type(rigid_body) :: body
        type(heavy_top) :: top
        real(wp) :: t = 0.0_wp
        real(wp) :: m0(3) = 0.0_wp
        real(wp) :: q0(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        real(wp) :: m(3) = 0.0_wp
        real(wp) :: q(4) = 0.0_wp
    end type top_case

    !> Keeps every state it is shown.
    type, extends(body_observer) :: recorder
        integer :: count = 0
        integer(int64), allocatable :: step(:)
        integer :: stop_at = -1             ! step at which it ends the run
        real(wp), allocatable :: t(:), m(:, :), q(:, :)
    contains
        procedure :: observe => record
    end type recorder

    !> Counts what it is shown and keeps the last state.
    type, extends(group_observer) :: group_recorder
        integer :: count = 0
        integer(int64) :: step = -1
        integer :: stop_at = -1             ! step at which it ends the run
        real(wp) :: t = -1.0_wp
        real(wp), allocatable :: m(:, :), q(:, :)
    contains
        procedure :: observe => record_group
    end type group_recorder

    !> Torque cos(t) about axis 3, whatever the attitude.
    type, extends(body_scene) :: pulsed_torque
    contains
        procedure :: torque => pulsed
    end type pulsed_torque

    !> A heavy top whose force turns with time. Torques in lanes must be its own, not those of its parent.
    type, extends(heavy_top) :: turning_top
    contains
        procedure :: torque => turning_torque
        procedure :: torque_change => turning_torque_change
    end type turning_top

    !> No torque, until it is NaN from a certain time on.
    type, extends(body_scene) :: spoilt_torque
        real(wp) :: until = 0.0_wp
    contains
        procedure :: torque => spoilt
    end type spoilt_torque

    !> The free flow as a drift written by a user.
    type, extends(body_drift) :: plain_drift
    contains
        procedure :: advance => advance_plainly
    end type plain_drift

    !> The free flow with a turn of 2e-6 h about axis 1 after it, which keeps |m| and not the energy.
    type, extends(body_drift) :: tilting_drift
    contains
        procedure :: advance => advance_tilting
    end type tilting_drift

    !> A drift that fails.
    type, extends(body_drift) :: failing_drift
    contains
        procedure :: advance => give_up
    end type failing_drift

    !> Dipoles along body axis 3, on a line in space, in each other's field.
    type, extends(group_scene) :: dipoles
        real(wp) :: strength = 0.05_wp
        real(wp) :: spoilt_from = huge(1.0_wp)      ! NaN from this time on
    contains
        procedure :: torques => dipole_torques
        procedure :: potential => dipole_potential
    end type dipoles

    !> Heavy tops that do not see each other.
    type, extends(group_scene) :: many_tops
        type(heavy_top) :: top
    contains
        procedure :: torques => torques_of_tops
    end type many_tops

contains

    !> 1: the paper's top, t = 20; 2 and 3: Hairer and Vilmart's asymmetric and flat body with weight, t = 10.
    function known_top(number) result(item)
        integer, intent(in) :: number
        type(top_case) :: item

        item%m0 = [1.8_wp, 0.4_wp, -0.9_wp]
        item%t = 10.0_wp
        select case (number)
        case (1)
            item%body = rigid_body([1.0_wp, 1.0126869887825154_wp, 3.3062374224730378_wp])
            item%top%force = [9.5586303547238536e-05_wp, 4.8777318247201465e-04_wp, &
                              -8.6772148817192390e-04_wp]
            item%m0 = [-3.4790957088547336e-01_wp, -1.9822914599675923e-01_wp, -9.1633189192763642e-01_wp]
            item%t = 20.0_wp
            item%m = [-0.3665884540247977060464576_wp, -0.1586967642476327008623542_wp, &
                      -0.916459835775987002285299_wp]
            item%q = [-0.8932047759654108019205434_wp, 0.1767070699549733365482911_wp, &
                      0.09444301415131595388439478_wp, 0.4025423663398956965216831_wp]
        case (2)
            item%body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
            item%m = [1.922573381663007023978764_wp, 0.7720232344670847864095929_wp, &
                      -0.2011054792035490068793853_wp]
            item%q = [0.9257399890934638143427711_wp, -0.351490667972754483791524_wp, &
                      0.1021838760186522953497751_wp, -0.09496440597984625829486457_wp]
        case default
            item%body = rigid_body([0.345_wp, 0.653_wp, 1.0_wp])
            item%m = [1.912382242821367087460918_wp, 1.392718886527803301572865_wp, &
                      0.9352825065552334909928896_wp]
            item%q = [-0.01116176735384536570224578_wp, -0.933244738088256104306539_wp, &
                      -0.359037465977168255346088_wp, -0.004666026662444763974661153_wp]
        end select
    end function known_top

    !> Different bodies and their start.
    subroutine start_of_group(body, m, q)
        type(rigid_body), intent(out) :: body(:)
        real(wp), intent(out) :: m(:, :), q(:, :)
        integer :: i

        do i = 1, size(body)
            body(i) = rigid_body([1.0_wp + 0.1_wp*i, 1.5_wp - 0.1_wp*i, 0.8_wp])
            m(:, i) = [sin(1.0_wp*i), cos(2.0_wp*i), sin(3.0_wp*i)]
            q(:, i) = [1.0_wp, cos(5.0_wp*i), sin(7.0_wp*i), cos(11.0_wp*i)]
            q(:, i) = q(:, i)/sqrt(sum(q(:, i)**2))
        end do
    end subroutine start_of_group

    !> Distance of two states, Euclidean; q and -q are the same attitude.
    pure function distance(m, q, m_ref, q_ref) result(d)
        real(wp), intent(in) :: m(3), q(4), m_ref(3), q_ref(4)
        real(wp) :: d

        d = sqrt(sum((m - m_ref)**2) + min(sum((q - q_ref)**2), sum((q + q_ref)**2)))
    end function distance

    !> Change of the straight line of best fit over the last 900 of 1001 values.
    pure function fitted_change(values) result(change)
        real(wp), intent(in) :: values(1001)
        real(wp) :: change
        real(wp) :: place(900)
        integer :: i

        place = [(i - 450.5_wp, i=1, 900)]
        change = 900*sum(place*values(102:1001))/sum(place**2)
    end function fitted_change

    subroutine record(self, step, t, m, q, stop)
        class(recorder), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t, m(3), q(4)
        logical, intent(inout) :: stop

        if (.not. allocated(self%t)) then
            allocate (self%step(2000), self%t(2000), self%m(3, 2000), self%q(4, 2000))
        end if
        self%count = self%count + 1
        self%step(self%count) = step
        self%t(self%count) = t
        self%m(:, self%count) = m
        self%q(:, self%count) = q
        if (step == self%stop_at) stop = .true.
    end subroutine record

    subroutine record_group(self, step, t, m, q, stop)
        class(group_recorder), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(in) :: m(:, :), q(:, :)
        logical, intent(inout) :: stop

        self%count = self%count + 1
        self%step = step
        self%t = t
        self%m = m
        self%q = q
        if (step == self%stop_at) stop = .true.
    end subroutine record_group

    pure subroutine pulsed(self, q, t, tau, stat)
        class(pulsed_torque), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        associate (unused_self => self, unused_q => q)
        end associate
        tau = [0.0_wp, 0.0_wp, cos(t)]
        stat = status_ok
    end subroutine pulsed

    pure subroutine spoilt(self, q, t, tau, stat)
        class(spoilt_torque), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        associate (unused_q => q)
        end associate
        tau = 0.0_wp
        if (t >= self%until) tau(2) = ieee_value(t, ieee_quiet_nan)
        stat = status_ok
    end subroutine spoilt

    subroutine advance_plainly(self, body, h, m, q, stat)
        class(plain_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat

        associate (unused_self => self)
        end associate
        call free_flow(body, h, m, q, stat)
    end subroutine advance_plainly

    subroutine advance_tilting(self, body, h, m, q, stat)
        class(tilting_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat
        real(wp) :: tilt(4)

        associate (unused_self => self)
        end associate
        call free_flow(body, h, m, q, stat)
        tilt = [1.0_wp, 1.0e-6_wp*h, 0.0_wp, 0.0_wp]    ! of norm 1 to rounding
        m = quat_rotate(quat_conjugate(tilt), m)
        q = quat_product(q, tilt)
    end subroutine advance_tilting

    subroutine give_up(self, body, h, m, q, stat)
        class(failing_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat

        associate (unused_self => self, unused_body => body)
        end associate
        m = m + h
        q = q + h
        stat = status_bad_option
    end subroutine give_up

    !> tau_i = Q_i^T (p_i x E_i), E_i the field of the others at centre i; p = Q e3, centres (j, 0, 0).
    pure subroutine dipole_torques(self, q, t, tau, stat)
        class(dipoles), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(out) :: tau(:, :)
        integer, intent(out) :: stat
        real(wp) :: p(3, size(q, 2))
        integer :: i

        p = moments_in_space(q)
        do i = 1, size(q, 2)
            tau(:, i) = quat_rotate(quat_conjugate(q(:, i)), cross(p(:, i), self%strength*field(p, i)))
        end do
        if (t >= self%spoilt_from) tau(3, :) = ieee_value(t, ieee_quiet_nan)
        stat = status_ok
    end subroutine dipole_torques

    !> V = -1/2 sum of p_i . E_i.
    pure subroutine dipole_potential(self, q, t, v, stat)
        class(dipoles), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), intent(out) :: v
        integer, intent(out) :: stat
        real(wp) :: p(3, size(q, 2))
        integer :: i

        associate (unused_t => t)
        end associate
        p = moments_in_space(q)
        v = 0.0_wp
        do i = 1, size(q, 2)
            v = v - 0.5_wp*self%strength*dot_product(p(:, i), field(p, i))
        end do
        stat = status_ok
    end subroutine dipole_potential

    pure function moments_in_space(q) result(p)
        real(wp), intent(in) :: q(:, :)
        real(wp) :: p(3, size(q, 2))
        integer :: i

        do i = 1, size(q, 2)
            p(:, i) = quat_rotate(q(:, i), [0.0_wp, 0.0_wp, 1.0_wp])
        end do
    end function moments_in_space

    !> Field at centre i of unit dipoles p on the x axis: (3 x (x . p) - p)/r^3.
    pure function field(p, i) result(e)
        real(wp), intent(in) :: p(:, :)
        integer, intent(in) :: i
        real(wp) :: e(3)
        integer :: j

        e = 0.0_wp
        do j = 1, size(p, 2)
            if (j /= i) e = e + ([3.0_wp, 0.0_wp, 0.0_wp]*p(1, j) - p(:, j))/abs(real(i - j, wp))**3
        end do
    end function field

    pure subroutine torques_of_tops(self, q, t, tau, stat)
        class(many_tops), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(out) :: tau(:, :)
        integer, intent(out) :: stat
        integer :: i

        stat = status_ok
        do i = 1, size(q, 2)
            if (stat == status_ok) call self%top%torque(q(:, i), t, tau(:, i), stat)
        end do
    end subroutine torques_of_tops

    pure subroutine turning_torque(self, q, t, tau, stat)
        class(turning_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        self%force = [sin(2*t), 0.0_wp, cos(2*t)]
        call self%heavy_top%torque(q, t, tau, stat)
    end subroutine turning_torque

    pure subroutine turning_torque_change(self, q, t, n, change, stat)
        class(turning_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t, n(3)
        real(wp), intent(out) :: change(3)
        integer, intent(out) :: stat

        self%force = [sin(2*t), 0.0_wp, cos(2*t)]
        call self%heavy_top%torque_change(q, t, n, change, stat)
    end subroutine turning_torque_change

end module frb_torque_cases
