!> The open loop: loops written by a user against `integrate`, plans, times.
module frb_test_open_loop
    use frb_checks, only: tally, worst_of, largest
    use frb_free_flow, only: free_flow, rigid_body
    use frb_invariants, only: kinetic_energy, spatial_momentum, total_energy
    use frb_kinds, only: wp
    use frb_rotations, only: quat_rotate, quat_to_matrix
    use frb_schemes, only: mirrored, scheme_names, splitting_scheme
    use frb_splitting, only: integrate
    use frb_splitting_plan, only: next_time, splitting_plan
    use frb_status, only: status_ok, status_bad_attitude, status_bad_option, status_bad_scheme, &
        status_bad_time
    use frb_torque_cases, only: dipoles, distance, known_top, start_of_group, top_case
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: test_open_loop

    real(wp), parameter :: eps = epsilon(1.0_wp)
    integer, parameter :: n = 7, names = size(scheme_names)

contains

    subroutine test_open_loop(t)
        type(tally), intent(inout) :: t

        call t%open_suite('open-loop', 44)
        call test_own_loop(t)
        call test_plans(t)
        call test_times(t)
        call test_units_and_sizes(t)
        call t%close_suite()
    end subroutine test_open_loop

    !> The recipe of splitting_plan, one body and many, every scheme with plain kicks; the torque is kept
    !> where the attitude does not change.
    subroutine test_own_loop(t)
        type(tally), intent(inout) :: t
        integer, parameter :: steps = 20
        real(wp), parameter :: h = 0.05_wp
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(splitting_plan) :: plan
        type(dipoles) :: scene
        type(rigid_body) :: body(n)
        real(wp) :: m(3), q(4), tau(3), m_own(3), q_own(4)
        real(wp) :: ms(3, n), qs(4, n), taus(3, n), ms_own(3, n), qs_own(4, n)
        integer :: i, k, step, stat, asked
        logical :: known

        item = known_top(2)
        do k = 1, names
            scheme = splitting_scheme(trim(scheme_names(k)))
            if (scheme%has_modified_kicks()) cycle
            plan = splitting_plan(scheme, h)
            m = item%m0
            q = item%q0
            call integrate(item%body, scheme, item%top, h, steps, m, q)
            m_own = item%m0
            q_own = item%q0
            known = .false.
            asked = 0
            do step = 1, steps
                do i = 1, plan%stages
                    call free_flow(item%body, plan%drift(i), m_own, q_own)
                    if (abs(plan%drift(i)) > 0.0_wp .or. .not. known) then
                        call item%top%torque(q_own, (step - 1)*h + plan%time(i), tau, stat)
                        asked = asked + 1
                    end if
                    known = .true.
                    m_own = m_own + plan%kick(i)*tau
                end do
                call free_flow(item%body, plan%drift(i), m_own, q_own)
            end do
            call t%at_most(trim(scheme_names(k))//'-in-a-loop-of-ones-own-is-integrate', &
                           distance(m_own, q_own, m, q), 1.0e-14_wp)
            call t%equal(trim(scheme_names(k))//'-asks-for-as-many-torques-as-the-scheme-has-stages', asked, &
                         steps*scheme%stages() + merge(0, 1, scheme%drift_first))

            call start_of_group(body, ms, qs)
            ms_own = ms
            qs_own = qs
            call integrate(body, scheme, scene, h, steps, ms, qs)
            do step = 1, steps
                do i = 1, plan%stages
                    call free_flow(body, plan%drift(i), ms_own, qs_own)
                    call scene%torques(qs_own, (step - 1)*h + plan%time(i), taus, stat)
                    ms_own = ms_own + plan%kick(i)*taus
                end do
                call free_flow(body, plan%drift(i), ms_own, qs_own)
            end do
            call t%at_most(trim(scheme_names(k))//'-of-a-group-in-a-loop-of-ones-own-is-integrate', &
                           largest([abs(ms_own - ms), abs(qs_own - qs)]), 1.0e-14_wp)
        end do
    end subroutine test_own_loop

    !> Contents of a plan; steps and schemes that have no plan.
    subroutine test_plans(t)
        type(tally), intent(inout) :: t
        type(splitting_scheme) :: scheme
        type(splitting_plan) :: plan
        real(wp) :: nan, worst
        integer :: k, i, stat
        logical :: sized, open_with_torque

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        worst = 0.0_wp
        sized = .true.
        open_with_torque = .true.
        do k = 1, names
            scheme = splitting_scheme(trim(scheme_names(k)))
            plan = splitting_plan(scheme, -0.3_wp, stat)
            sized = sized .and. stat == status_ok .and. plan%status == status_ok &
                    .and. size(plan%drift) == plan%stages + 1 .and. size(plan%kick) == plan%stages &
                    .and. size(plan%time) == plan%stages
            worst = worst_of(worst, abs([sum(plan%drift), sum(plan%kick)] + 0.3_wp))
            do i = 1, plan%stages
                worst = worst_of(worst, abs(plan%time(i) - sum(plan%drift(1:i))))
            end do
            if (scheme%drift_first .eqv. all(abs(plan%drift([1, plan%stages + 1])) <= 0.0_wp)) then
                open_with_torque = .false.
            end if
        end do
        call t%ok('a-plan-has-as-many-of-each-as-it-has-stages', sized)
        call t%at_most('drifts-and-kicks-sum-to-h-and-times-follow-the-drifts', worst, 4*eps)
        call t%ok('plans-that-open-with-a-kick-have-no-drift-at-their-ends', open_with_torque)
        scheme = splitting_scheme('strang')
        plan = splitting_plan(scheme, 0.0_wp, stat)
        call t%ok('no-plan-for-no-step', all([stat, plan%status] == status_bad_time) .and. plan%stages == 0 &
                  .and. all(abs(plan%drift) <= 0.0_wp) .and. size(plan%drift) == 1)
        plan = splitting_plan(scheme, nan)
        call t%equal('no-plan-for-a-nan-step', plan%status, status_bad_time)
        plan = splitting_plan(splitting_scheme([0.5_wp, 0.5_wp], [0.9_wp]), 0.1_wp, stat)
        call t%ok('no-plan-for-no-scheme', all([stat, plan%status] == status_bad_scheme) &
                  .and. plan%stages == 0)
        plan = splitting_plan(splitting_scheme('none'), 0.1_wp)
        call t%equal('a-plan-says-what-the-scheme-says', plan%status, status_bad_option)
    end subroutine test_plans

    !> Times of steps, from any start, equal start + steps*h; after 2**53 steps of h the time does not grow.
    subroutine test_times(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: starts(6) = [0.0_wp, 0.1_wp, -3.7_wp, 1.0e6_wp + 0.37_wp, -1.0e-3_wp, 0.062_wp]
        real(wp), parameter :: h(4) = [0.1_wp, -0.1_wp, 1.0_wp/3, 1.0e-3_wp]
        real(wp) :: time, worst
        integer :: i, j, k

        worst = 0.0_wp
        do i = 1, size(starts)
            do j = 1, size(h)
                time = starts(i)
                do k = 1, 200000
                    time = next_time(time, h(j))
                end do
                worst = worst_of(worst, abs(time - (starts(i) + 200000*h(j))) &
                                 /spacing(max(abs(time), abs(starts(i)))))
            end do
        end do
        call t%at_most('two-hundred-thousand-steps-of-time-lose-two-units', worst, 2.0_wp)
        call t%close_to('time-stands-where-a-step-is-below-its-last-digit', next_time(1.0e20_wp, 0.1_wp), &
                        1.0e20_wp, 0.0_wp)
        call t%ok('times-of-extreme-steps-are-finite', abs(next_time(1.0e300_wp, 1.0e-300_wp)) < huge(time) &
                  .and. abs(next_time(-1.0e-300_wp, 1.0e300_wp)) < huge(time))
    end subroutine test_times

    !> Routines that need a quaternion of norm one refuse others; arrays that do not match.
    subroutine test_units_and_sizes(t)
        type(tally), intent(inout) :: t
        type(top_case) :: item
        type(splitting_scheme) :: scheme
        type(dipoles) :: scene
        type(rigid_body) :: body(n), none
        real(wp) :: m(3), q(4), ms(3, n), qs(4, n), energies(3)
        integer :: stat, inside

        item = known_top(2)
        scheme = splitting_scheme('strang')
        m = item%m0
        q = item%q0*(1 + 9.0e-7_wp)
        call integrate(item%body, scheme, item%top, 0.05_wp, 1, m, q, stat=inside)
        m = item%m0
        q = item%q0*(1 - 1.1e-6_wp)
        call integrate(item%body, scheme, item%top, 0.05_wp, 1, m, q, stat=stat)
        call t%ok('a-quaternion-off-by-a-millionth-is-refused', inside == status_ok &
                  .and. stat == status_bad_attitude)
        q = 2*item%q0
        call integrate(item%body, scheme, item%top, 0.05_wp, 1, m, q, stat=stat)
        call t%ok('a-quaternion-of-norm-two-is-refused', stat == status_bad_attitude &
                  .and. all(abs(m - item%m0) <= 0.0_wp))
        call start_of_group(body, ms, qs)
        qs(:, 3) = 2*qs(:, 3)
        call integrate(body, scheme, scene, 0.05_wp, 1, ms, qs, stat=stat)
        call t%equal('in-a-group-too', stat, status_bad_attitude)
        call t%ok('what-rotates-by-it-gives-nan', all(ieee_is_nan(quat_rotate(q, m))) &
                  .and. all(ieee_is_nan(quat_to_matrix(q))) .and. all(ieee_is_nan(spatial_momentum(m, q))) &
                  .and. all(ieee_is_nan(spatial_momentum(ms, qs))))
        energies = [total_energy(body, scene, 0.0_wp, ms, qs(:, 2:)), &
                    total_energy(body(2:), scene, 0.0_wp, ms, qs), &
                    total_energy(body(1), scene, 0.0_wp, ms, ms)]
        call t%ok('energies-of-arrays-that-do-not-match-are-nan', &
                  ieee_is_nan(kinetic_energy(body(2:), ms)) .and. ieee_is_nan(kinetic_energy(body, qs)) &
                  .and. ieee_is_nan(kinetic_energy(body(1), qs)) .and. ieee_is_nan(kinetic_energy(none, m)) &
                  .and. all(ieee_is_nan(energies)))
        call t%ok('momenta-of-arrays-that-do-not-match-are-nan', &
                  all(ieee_is_nan(spatial_momentum(ms, qs(:, 2:)))) &
                  .and. all(ieee_is_nan(spatial_momentum(qs, qs))))
        call t%ok('a-half-too-short-for-a-palindrome-gives-nan', &
                  all(ieee_is_nan(mirrored([1.0_wp, 2.0_wp], 5))))
    end subroutine test_units_and_sizes

end module frb_test_open_loop
