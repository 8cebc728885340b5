!> Schemes whose kicks contain the change of the torque: observed orders with the scene's own change and with
!> displaced torques, one body and many, bodies by tensor, plans, long runs, refusals.
module frb_test_modified_kicks
    use frb_checks, only: largest, tally, worst_of
    use frb_free_flow, only: free_flow, rigid_body
    use frb_invariants, only: total_energy
    use frb_kinds, only: wp
    use frb_rotations, only: quat_conjugate, quat_product, quat_rotate, quat_to_matrix
    use frb_scenes, only: heavy_top
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    use frb_splitting_plan, only: splitting_plan
    use frb_status, only: status_ok, status_bad_option, status_bad_scheme, status_bad_torque
    use frb_torque, only: body_scene, one_after_the_other
    use frb_torque_cases, only: top_case, known_top, distance, recorder, dipoles, fitted_change, turning_top
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: test_modified_kicks

    !> A heavy top that provides its torque alone, and counts the calls. From the time `spoilt_from` on the
    !> second torque at a time, that at a displaced attitude, is NaN.
    type, extends(body_scene) :: bare_top
        type(heavy_top) :: top
        integer :: asked = 0
        real(wp) :: spoilt_from = huge(1.0_wp)
        real(wp) :: last_time = -1.0_wp
    contains
        procedure :: torque => bare_torque
    end type bare_top

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_modified_kicks(t)
        type(tally), intent(inout) :: t

        call t%open_suite('modified-kicks', 45)
        call test_change(t)
        call test_both(t)
        call test_orders(t)
        call test_other_axes(t)
        call test_group(t)
        call test_time(t)
        call test_plan(t)
        call test_long_runs(t)
        call test_refused(t)
        call t%close_suite()
    end subroutine test_modified_kicks

    !> The change of a heavy top's torque against a difference quotient.
    subroutine test_change(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: small = 1.0e-5_wp    ! error of the quotient: small**2 and eps/small
        type(heavy_top) :: top
        real(wp) :: q(4), n(3), change(3), forth(3), back(3), turn(4)
        integer :: stat

        top = heavy_top(force=[0.3_wp, -0.7_wp, 1.1_wp], centre=[0.5_wp, 0.9_wp, -0.4_wp])
        q = [0.1_wp, 0.7_wp, 0.5_wp, 0.5_wp]
        n = [0.6_wp, -1.1_wp, 0.2_wp]
        turn = [cos(small*norm2(n)/2), sin(small*norm2(n)/2)*n/norm2(n)]
        call top%torque_change(q, 0.0_wp, n, change, stat)
        call t%equal('a-heavy-top-tells-the-change-of-its-torque', stat, status_ok)
        call top%torque(quat_product(q, turn), 0.0_wp, forth, stat)
        call top%torque(quat_product(q, quat_conjugate(turn)), 0.0_wp, back, stat)
        call t%close_to('the-change-is-that-of-the-torque', change, (forth - back)/(2*small), 1.0e-9_wp)
    end subroutine test_change

    !> Torque and its change g by one call against two calls, for a body in any axes and two centres, one of
    !> them on the third axis; an extension of the heavy top gets its own torque.
    subroutine test_both(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: response(3, 3) = reshape([1.4_wp, 0.2_wp, -0.3_wp, 0.2_wp, 0.9_wp, 0.1_wp, &
                                                         -0.3_wp, 0.1_wp, 1.1_wp], [3, 3])
        type(heavy_top) :: top
        type(turning_top) :: heir
        real(wp) :: q(4), tau(3), g(3), tau_alone(3), g_alone(3), worst
        integer :: stat, i

        q = [0.1_wp, 0.7_wp, 0.5_wp, 0.5_wp]
        worst = 0.0_wp
        do i = 0, 1
            top = heavy_top(force=[0.3_wp, -0.7_wp, 1.1_wp], centre=[0.5_wp*i, 0.9_wp*i, -0.4_wp])
            call top%torque_and_gradient(q, 0.0_wp, response, tau, g, stat)
            call one_after_the_other(top, q, 0.0_wp, response, tau_alone, g_alone, stat)
            worst = largest([worst, abs(tau - tau_alone), abs(g - g_alone)])
        end do
        call t%at_most('torque-and-g-at-once', worst, 16*eps)
        heir%heavy_top = top
        call heir%torque_and_gradient(q, 0.7_wp, response, tau, g, stat)
        call one_after_the_other(heir, q, 0.7_wp, response, tau_alone, g_alone, stat)
        call t%at_most('an-heir-gives-its-own', largest([abs(tau - tau_alone), abs(g - g_alone)]), 0.0_wp)
    end subroutine test_both

    !> The order seen on the Hairer-Vilmart tops, between numbers of steps whose errors are two decades apart.
    subroutine test_orders(t)
        type(tally), intent(inout) :: t

        call check_order(t, 'fg4', 2, 70, 240, 4, own=.true.)
        call check_order(t, 'fg6a', 2, 62, 140, 6, own=.true.)
        call check_order(t, 'fg6a', 3, 93, 210, 6, own=.true.)
        call check_order(t, 'fg6b', 2, 93, 210, 6, own=.true.)
        call check_order(t, 'fg6b', 1, 27, 62, 6, own=.true.)
        call check_order(t, 'fg8', 2, 48, 96, 8, own=.true.)
        call check_order(t, 'srkn17', 2, 48, 96, 8, own=.true.)
        call check_order(t, 'fg4', 2, 70, 240, 4, own=.false.)
        call check_order(t, 'fg6a', 2, 93, 210, 6, own=.false.)
        call check_order(t, 'fg6b', 2, 93, 210, 6, own=.false.)
        call check_order(t, 'fg4', 2, 70, 240, 4, own=.false., displaced=1)
        call check_order(t, 'fg6a', 2, 93, 300, 4, own=.false., displaced=1)
    end subroutine test_orders

    subroutine check_order(t, name, number, few, many, order, own, displaced)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: name
        integer, intent(in) :: number, few, many, order
        logical, intent(in) :: own                  ! the scene tells the change of its torque
        integer, intent(in), optional :: displaced
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(bare_top) :: bare
        real(wp) :: m(3), q(4), error(2), order_seen
        character(:), allocatable :: label
        character(1) :: digit
        integer :: i, n

        item = known_top(number)
        scheme = splitting_scheme(name, displaced=displaced)
        bare%top = item%top
        do i = 1, 2
            n = merge(few, many, i == 1)
            m = item%m0
            q = item%q0
            if (own) then
                call integrate(item%body, scheme, item%top, item%t/n, n, m, q, compensated=.true.)
            else
                call integrate(item%body, scheme, bare, item%t/n, n, m, q, compensated=.true.)
            end if
            error(i) = distance(m, q, item%m, item%q)
        end do
        order_seen = log(error(1)/error(2))/log(real(many, wp)/few)
        write (digit, '(i0)') number
        label = name//'-with-'
        if (own) then
            label = label//'the-change-of-the-torque'
        else if (present(displaced)) then
            label = label//'one-displaced-torque'
        else
            label = label//'displaced-torques'
        end if
        call t%close_to(label//'-shows-its-order-on-top-'//digit, order_seen, real(order, wp), 0.2_wp)
        call t%ok(label//'-error-falls-by-two-decades-on-top-'//digit, error(1) >= 100*error(2))
    end subroutine check_order

    !> A body by tensor: the same motion in other axes.
    subroutine test_other_axes(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: axes(4) = [0.5_wp, 0.1_wp, -0.7_wp, 0.5_wp]
        type(top_case) :: item
        type(heavy_top) :: top
        real(wp) :: rotation(3, 3), tensor(3, 3), m(3), q(4), m_other(3), q_other(4)
        integer :: i

        item = known_top(2)
        rotation = quat_to_matrix(axes)
        tensor = 0.0_wp
        do i = 1, 3
            tensor(i, i) = 0.6_wp + 0.2_wp*(i - 1)
        end do
        tensor = matmul(rotation, matmul(tensor, transpose(rotation)))
        top = heavy_top(force=item%top%force, centre=quat_rotate(axes, item%top%centre))
        m = item%m0
        q = item%q0
        m_other = quat_rotate(axes, m)
        q_other = quat_product(q, quat_conjugate(axes))
        ! Compensated: the difference is then that of the axes and of the tensor, not of a hundred roundings.
        call integrate(item%body, splitting_scheme('fg6a'), item%top, 0.1_wp, 100, m, q, compensated=.true.)
        call integrate(rigid_body(0.5_wp*(tensor + transpose(tensor))), splitting_scheme('fg6a'), top, &
                       0.1_wp, 100, m_other, q_other, compensated=.true.)
        m_other = quat_rotate(quat_conjugate(axes), m_other)
        q_other = quat_product(q_other, axes)
        call t%at_most('fg6a-is-the-same-in-other-axes', distance(m_other, q_other, m, q), 100*eps)
    end subroutine test_other_axes

    !> Dipoles that see each other: order six with displaced torques.
    subroutine test_group(t)
        type(tally), intent(inout) :: t
        type(dipoles) :: scene
        type(rigid_body) :: body
        real(wp) :: m0(3, 3), q0(4, 3), m(3, 3), q(4, 3), m_ref(3, 3), q_ref(4, 3), error(2), order_seen
        integer, parameter :: steps(2) = [15, 35]
        integer :: i, k

        body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        scene%strength = 0.5_wp
        m0 = reshape([0.5_wp, 0.2_wp, -0.3_wp, -0.1_wp, 0.8_wp, 0.3_wp, 0.4_wp, -0.6_wp, 0.1_wp], [3, 3])
        q0 = reshape([0.8_wp, 0.6_wp, 0.0_wp, 0.0_wp, 0.6_wp, 0.0_wp, 0.8_wp, 0.0_wp, 0.5_wp, 0.5_wp, &
                      0.5_wp, 0.5_wp], [4, 3])
        m_ref = m0
        q_ref = q0
        call integrate(body, splitting_scheme('srkn17'), scene, 0.01_wp, 500, m_ref, q_ref)
        do k = 1, 3
            do i = 1, 2
                m = m0
                q = q0
                call integrate(body, splitting_scheme(merge('fg6a', 'fg6b', k /= 2), &
                                                      displaced=merge(1, 2, k == 3)), scene, &
                               5.0_wp/steps(i), steps(i), m, q, compensated=.true.)
                error(i) = norm2(m - m_ref) + norm2(q - q_ref)
            end do
            order_seen = log(error(1)/error(2))/log(real(steps(2), wp)/steps(1))
            select case (k)
            case (3)
                call t%close_to('a-group-with-one-displaced-torque-shows-order-four', order_seen, 4.0_wp, &
                                0.4_wp)
            case default
                call t%close_to('a-group-with-displaced-torques-shows-order-six', order_seen, 6.0_wp, 0.3_wp)
            end select
        end do
    end subroutine test_group

    !> A force that turns with time: the torque and its change are those of the time of the stage.
    subroutine test_time(t)
        type(tally), intent(inout) :: t
        type(turning_top) :: top
        type(rigid_body) :: body
        real(wp) :: m(3), q(4), m_ref(3), q_ref(4), error(2), order_seen, time
        integer, parameter :: steps(2) = [20, 46]
        integer :: i

        body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        m_ref = [1.8_wp, 0.4_wp, -0.9_wp]
        q_ref = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        time = 1.0_wp
        call integrate(body, splitting_scheme('srkn17'), top, 0.01_wp, 500, m_ref, q_ref, t=time)
        do i = 1, 2
            m = [1.8_wp, 0.4_wp, -0.9_wp]
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            time = 1.0_wp
            call integrate(body, splitting_scheme('fg6a'), top, 5.0_wp/steps(i), steps(i), m, q, t=time, &
                           compensated=.true.)
            error(i) = distance(m, q, m_ref, q_ref)
        end do
        order_seen = log(error(1)/error(2))/log(real(steps(2), wp)/steps(1))
        call t%close_to('fg6a-keeps-its-order-where-the-force-turns', order_seen, 6.0_wp, 0.3_wp)
    end subroutine test_time

    !> A loop by hand, after the recipe of the plan, gives the result of `integrate`.
    subroutine test_plan(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_plan) :: plan
        type(splitting_scheme) :: scheme
        type(bare_top) :: bare
        real(wp) :: m(3), q(4), m_hand(3), q_hand(4), tau(3), n(3), change(3)
        integer :: i, k, step, stat

        item = known_top(2)
        do k = 1, 2
            scheme = splitting_scheme(merge('fg6a', 'fg6b', k == 1))
            plan = splitting_plan(scheme, 0.1_wp)
            m_hand = item%m0
            q_hand = item%q0
            do step = 1, 3
                do i = 1, plan%stages + 1
                    if (abs(plan%drift(i)) > 0.0_wp) call free_flow(item%body, plan%drift(i), m_hand, q_hand)
                    if (i > plan%stages) exit
                    call item%top%torque(q_hand, 0.0_wp, tau, stat)
                    n = tau/item%body%moments()
                    call item%top%torque_change(q_hand, 0.0_wp, n, change, stat)
                    m_hand = m_hand + plan%kick(i)*tau
                    m_hand = m_hand + plan%modified(i)*2*(change + [n(2)*tau(3) - n(3)*tau(2), &
                                                                    n(3)*tau(1) - n(1)*tau(3), &
                                                                    n(1)*tau(2) - n(2)*tau(1)])
                end do
            end do
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, 0.1_wp, 3, m, q)
            call t%at_most('a-plan-with-modified-kicks-is-what-integrate-does', &
                           distance(m, q, m_hand, q_hand), 8*eps)
        end do
        bare%top = item%top
        m = item%m0
        q = item%q0
        call integrate(item%body, splitting_scheme('fg6b'), bare, 0.1_wp, 10, m, q)
        ! Of six kicks the two first and two last are modified; the last of a step is the first of the next.
        call t%equal('displaced-torques-are-two-for-each-modified-kick', bare%asked, 10*(5 + 3*2) + 3)
        bare%asked = 0
        call integrate(item%body, splitting_scheme('fg6a', displaced=1), bare, 0.1_wp, 10, m, q)
        call t%equal('one-displaced-torque-is-one-for-each-modified-kick', bare%asked, 10*5*2)
    end subroutine test_plan

    !> The paper's long run: T = 5e4, energy within 1e-13 and without a trend, the mean of four starts.
    subroutine test_long_runs(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: sizes(2) = [0.25_wp, 0.25_wp]
        character(4), parameter :: names(2) = ['fg6a', 'fg6b']
        type(top_case) :: item
        type(recorder) :: record
        real(wp) :: m(3), q(4), energy(1001), trend, worst, v(1001)
        integer :: i, j, k, steps

        item = known_top(1)
        do j = 1, 2
            trend = 0.0_wp
            worst = 0.0_wp
            steps = t%many(nint(5.0e4_wp/sizes(j)))
            do k = 0, 3
                m = item%m0*(1 + 0.001_wp*k)
                q = item%q0
                record%count = 0
                call integrate(item%body, splitting_scheme(names(j)), item%top, sizes(j), steps, m, q, &
                               record, every=steps/1000)
                do i = 1, 1001
                    energy(i) = total_energy(item%body, item%top, record%t(i), record%m(:, i), record%q(:, i))
                end do
                v = energy - energy(1)
                worst = worst_of(worst, abs(v))
                trend = trend + fitted_change(energy)/4
            end do
            call t%at_most(names(j)//'-energy-of-the-papers-top-stays-within-1e-13', worst, 1.0e-13_wp)
            call t%at_most(names(j)//'-energy-error-has-no-trend', abs(trend), 4.0e-14_wp)
        end do
    end subroutine test_long_runs

    !> Runs that fail end with their status and the state of the last whole step.
    subroutine test_refused(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(bare_top) :: bare
        real(wp) :: m(3), q(4), time
        integer :: stat

        scheme = splitting_scheme([0.5_wp, 0.5_wp], [0.5_wp, 0.0_wp, 0.5_wp], &
                                  c=[0.0_wp, 0.01_wp, 0.0_wp], displaced=1)
        call t%equal('one-displaced-torque-is-refused-where-its-kick-is-zero', scheme%status, &
                     status_bad_scheme)
        scheme = splitting_scheme('fg6a', displaced=0)
        call t%equal('no-displaced-torque-is-refused', scheme%status, status_bad_option)
        item = known_top(2)
        bare%top = item%top
        bare%spoilt_from = 0.45_wp
        m = item%m0
        q = item%q0
        time = 0.0_wp
        call integrate(item%body, splitting_scheme('fg6a'), bare, 0.1_wp, 10, m, q, t=time, stat=stat)
        call t%equal('a-displaced-torque-that-is-nan-ends-the-run', stat, status_bad_torque)
        call t%close_to('and-leaves-the-time-of-the-last-whole-step', time, 0.4_wp, eps)
    end subroutine test_refused

    subroutine bare_torque(self, q, t, tau, stat)
        class(bare_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        self%asked = self%asked + 1
        call self%top%torque(q, t, tau, stat)
        if (t >= self%spoilt_from .and. abs(t - self%last_time) <= 0.0_wp) tau = ieee_value(t, ieee_quiet_nan)
        self%last_time = t
    end subroutine bare_torque

end module frb_test_modified_kicks
