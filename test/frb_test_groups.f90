!> Many bodies under torques: against one at a time, orders, invariants, observers, refused input.
module frb_test_groups
    use frb_checks, only: tally, largest, worst_of
    use frb_free_flow, only: rigid_body
    use frb_invariants, only: kinetic_energy, spatial_momentum, total_energy
    use frb_kinds, only: wp
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    use frb_status, only: status_ok, status_bad_attitude, status_bad_count, status_bad_moments, &
        status_bad_momentum, status_bad_option, status_bad_time, status_bad_torque
    use frb_torque_cases, only: dipoles, distance, failing_drift, group_recorder, many_tops, plain_drift, &
        start_of_group
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: test_groups

    real(wp), parameter :: eps = epsilon(1.0_wp)
    integer, parameter :: n = 7

contains

    subroutine test_groups(t)
        type(tally), intent(inout) :: t

        call t%open_suite('groups', 40)
        call test_against_one(t)
        call test_compensated(t)
        call test_dipoles(t)
        call test_refused(t)
        call t%close_suite()
    end subroutine test_groups

    !> Bodies that do not see each other move as if alone.
    subroutine test_against_one(t)
        type(tally), intent(inout) :: t
        character(8), parameter :: names(2) = [character(8) :: 'srkn14', 'srkn11']
        type(rigid_body) :: body(n)
        type(many_tops) :: scene
        type(splitting_scheme) :: scheme
        type(plain_drift) :: drift
        real(wp) :: m(3, n), q(4, n), m_one(3, n), q_one(4, n), m_drift(3, n), q_drift(4, n), time, apart(3)
        integer :: i, k

        do k = 1, 2
            scheme = splitting_scheme(trim(names(k)))
            call start_of_group(body, m, q)
            m_one = m
            q_one = q
            m_drift = m
            q_drift = q
            time = 0.0_wp
            call integrate(body, scheme, scene, 0.05_wp, 40, m, q, t=time)
            call integrate(body, scheme, scene, 0.05_wp, 40, m_drift, q_drift, drift=drift)
            do i = 1, n
                call integrate(body(i), scheme, scene%top, 0.05_wp, 40, m_one(:, i), q_one(:, i))
            end do
            call t%close_to('time-of-a-group-goes-on', time, 2.0_wp, 4*eps)
            call t%at_most('bodies-that-do-not-interact-move-as-if-alone', largest([abs(m - m_one)]) &
                           + largest([abs(q - q_one)]), 256*eps)
            call t%at_most('a-drift-of-the-users-moves-each-body', largest([abs(m_drift - m_one)]) &
                           + largest([abs(q_drift - q_one)]), 256*eps)
            call start_of_group(body, m, q)
            m_one = m
            q_one = q
            m_drift = m
            q_drift = q
            call integrate(body(1), scheme, scene, 0.05_wp, 40, m, q)
            call integrate(body(1:1), scheme, scene, 0.05_wp, 40, m_drift, q_drift)
            do i = 1, n
                call integrate(body(1), scheme, scene%top, 0.05_wp, 40, m_one(:, i), q_one(:, i))
                apart(1) = distance(m(:, i), q(:, i), m_one(:, i), q_one(:, i))
                if (i == 1) apart(2) = 0.0_wp
                apart(2) = worst_of(apart(2), apart(1))
            end do
            call t%at_most('alike-bodies-move-as-if-alone', apart(2), 256*eps)
            call t%close_to('a-body-or-an-array-of-one-is-the-same', [m_drift, q_drift], [m, q], 0.0_wp)
        end do
    end subroutine test_against_one

    !> Rounding errors of a group are carried over as those of one body: a plain run is thousands of eps off.
    subroutine test_compensated(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: body(n)
        type(many_tops) :: scene
        type(splitting_scheme) :: scheme
        real(wp) :: m(3, n), q(4, n), m_one(3, n), q_one(4, n)
        integer :: i

        scheme = splitting_scheme('srkn14')
        call start_of_group(body, m, q)
        m_one = m
        q_one = q
        call integrate(body, scheme, scene, 0.01_wp, 2000, m, q, compensated=.true.)
        do i = 1, n
            call integrate(body(i), scheme, scene%top, 0.01_wp, 2000, m_one(:, i), q_one(:, i), &
                           compensated=.true.)
        end do
        call t%at_most('a-compensated-group-goes-as-its-bodies-alone', &
                       largest([abs(m - m_one), abs(q - q_one)]), 512*eps)
    end subroutine test_compensated

    !> Interacting dipoles: order, energy, reversal, observers.
    subroutine test_dipoles(t)
        type(tally), intent(inout) :: t
        character(8), parameter :: names(4) = [character(8) :: 'strang', 'srkn6', 'srkn11', 'srkn14']
        integer, parameter :: few(4) = [60, 60, 20, 12], orders(4) = [2, 4, 6, 6]
        type(rigid_body) :: body(n)
        type(dipoles) :: scene
        type(splitting_scheme) :: scheme
        type(group_recorder) :: record
        real(wp) :: m(3, n), q(4, n), m_fine(3, n), q_fine(4, n), m_start(3, n), q_start(4, n)
        real(wp) :: energy, error(2)
        integer :: i, k

        scene%strength = 0.5_wp
        call start_of_group(body, m_start, q_start)
        m_fine = m_start
        q_fine = q_start
        call integrate(body, splitting_scheme('srkn14'), scene, 0.01_wp, 300, m_fine, q_fine)
        do k = 1, 4
            scheme = splitting_scheme(trim(names(k)))
            do i = 1, 2
                m = m_start
                q = q_start
                call integrate(body, scheme, scene, 3.0_wp/(i*few(k)), i*few(k), m, q)
                error(i) = largest([abs(m - m_fine), abs(q - q_fine)])
            end do
            call t%close_to(trim(names(k))//'-shows-its-order-on-interacting-dipoles', &
                            log(error(1)/error(2))/log(2.0_wp), real(orders(k), wp), 0.25_wp)
        end do
        energy = total_energy(body, scene, 0.0_wp, m_start, q_start)
        call t%close_to('energy-of-interacting-dipoles-is-kept', &
                        total_energy(body, scene, 3.0_wp, m_fine, q_fine), energy, 1024*eps)
        call t%ok('dipoles-exchange-kinetic-and-potential-energy', &
                  abs(kinetic_energy(body, m_fine) - kinetic_energy(body, m_start)) > 1.0e-2_wp)
        m = m_fine
        q = q_fine
        call integrate(body, splitting_scheme('srkn14'), scene, -0.01_wp, 300, m, q)
        call t%at_most('dipoles-run-back-to-their-start', &
                       largest([abs(m - m_start), abs(q - q_start)]), 2048*eps)
        m = m_start
        q = q_start
        call integrate(body, splitting_scheme('srkn14'), scene, 0.01_wp, 300, m, q, record, every=100)
        call t%close_to('watching-a-group-does-not-change-its-run', [m, q], [m_fine, q_fine], 0.0_wp)
        call t%ok('group-observer-is-called-at-the-start-and-every-100-steps', &
                  record%count == 4 .and. record%step == 300)
        call t%close_to('group-observer-sees-the-end-as-it-is-returned', [record%m, record%q], [m, q], 0.0_wp)
        call t%close_to('group-observer-is-told-the-time', record%t, 3.0_wp, 4*eps)
        ! The same steps in a compensated run, with and without observer, and back.
        m = m_start
        q = q_start
        call integrate(body, splitting_scheme('srkn14'), scene, 0.01_wp, 300, m, q, compensated=.true.)
        call t%at_most('a-compensated-group-goes-the-same-way', &
                       largest([abs(m - m_fine), abs(q - q_fine)]), 1024*eps)
        m_fine = m
        q_fine = q
        m = m_start
        q = q_start
        call integrate(body, splitting_scheme('srkn14'), scene, 0.01_wp, 300, m, q, record, every=100, &
                       compensated=.true.)
        call t%close_to('watching-a-compensated-group-does-not-change-its-run', [m, q], &
                        [m_fine, q_fine], 0.0_wp)
        call t%close_to('group-observer-sees-the-end-of-a-compensated-run-as-it-is-returned', &
                        [record%m, record%q], [m, q], 0.0_wp)
        call integrate(body, splitting_scheme('srkn14'), scene, -0.01_wp, 300, m, q, compensated=.true.)
        call t%at_most('a-compensated-group-runs-back-to-its-start', &
                       largest([abs(m - m_start), abs(q - q_start)]), 8*eps)
        call t%close_to('energy-of-alike-bodies-is-a-sum', kinetic_energy(body(2), m), &
                        sum([(kinetic_energy(body(2), m(:, i)), i=1, n)]), 16*eps)
        call t%close_to('momentum-in-space-is-a-sum', spatial_momentum(m, q), &
                        sum(reshape([(spatial_momentum(m(:, i), q(:, i)), i=1, n)], [3, n]), dim=2), 16*eps)
    end subroutine test_dipoles

    !> Each way a call for a group can be wrong: the code, and the state untouched.
    subroutine test_refused(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: body(n), bad(n)
        type(dipoles) :: scene
        type(failing_drift) :: failing
        type(splitting_scheme) :: scheme
        real(wp) :: m(3, n), q(4, n), m_start(3, n), q_start(4, n)
        integer :: stat

        call start_of_group(body, m, q)
        m_start = m
        q_start = q
        scheme = splitting_scheme('srkn14')
        call ends_with_a_whole_step('torque-that-becomes-nan', scheme)
        call ends_with_a_whole_step('torque-that-becomes-nan-in-a-bab-scheme', splitting_scheme('srkn11'))
        call integrate(body, scheme, scene, 0.0_wp, 10, m, q, stat=stat)
        call refused('zero-step', status_bad_time)
        call integrate(body, scheme, scene, 0.1_wp, -10, m, q, stat=stat)
        call refused('negative-number-of-steps', status_bad_count)
        call integrate(body(1:2), scheme, scene, 0.1_wp, 10, m, q, stat=stat)
        call refused('wrong-number-of-bodies', status_bad_count)
        call integrate(body, scheme, scene, 0.1_wp, 10, m, q(:, 1:n - 1), stat=stat)
        call refused('wrong-number-of-attitudes', status_bad_count)
        call integrate(body, scheme, scene, 0.1_wp, 10, q, q, stat=stat)
        call refused('momenta-of-four-components', status_bad_count)
        call integrate(body, scheme, scene, 0.1_wp, 10, m, q, drift=failing, stat=stat)
        call refused('drift-that-fails', status_bad_option)
        bad = body
        bad(3) = rigid_body([1.0_wp, -1.0_wp, 1.0_wp])
        call integrate(bad, scheme, scene, 0.1_wp, 10, m, q, stat=stat)
        call refused('one-bad-body', status_bad_moments)
        m(2, 5) = ieee_value(1.0_wp, ieee_quiet_nan)
        call integrate(body, scheme, scene, 0.1_wp, 10, m, q, stat=stat)
        call t%equal('one-nan-momentum-is-refused', stat, status_bad_momentum)
        m = m_start
        q(:, 4) = 0.0_wp
        call integrate(body, scheme, scene, 0.1_wp, 10, m, q, stat=stat)
        call t%equal('one-attitude-of-norm-zero-is-refused', stat, status_bad_attitude)
        call integrate(body(1:0), scheme, scene, 0.1_wp, 10, m(:, 1:0), q(:, 1:0), stat=stat)
        call t%equal('no-bodies-at-all-are-fine', stat, status_ok)

    contains

        !> Torques that are NaN from time 0.5 on end a run in steps of 0.1 with step 4 or 5.
        subroutine ends_with_a_whole_step(what, scheme)
            character(*), intent(in) :: what
            type(splitting_scheme), intent(in) :: scheme
            real(wp) :: m_short(3, n), q_short(4, n), time
            integer :: done

            time = 0.0_wp
            scene%spoilt_from = 0.5_wp
            call integrate(body, scheme, scene, 0.1_wp, 100, m, q, t=time, stat=stat)
            scene%spoilt_from = huge(time)
            done = nint(time/0.1_wp)
            m_short = m_start
            q_short = q_start
            call integrate(body, scheme, scene, 0.1_wp, done, m_short, q_short)
            call t%ok(what//'-ends-the-run-with-the-last-whole-step', stat == status_bad_torque &
                      .and. (done == 4 .or. done == 5) .and. all(abs(m - m_short) <= 0.0_wp) &
                      .and. all(abs(q - q_short) <= 0.0_wp))
            m = m_start
            q = q_start
        end subroutine ends_with_a_whole_step

        subroutine refused(what, code)
            character(*), intent(in) :: what
            integer, intent(in) :: code

            call t%ok(what//'-is-refused-and-the-group-untouched', stat == code &
                      .and. all(abs(m - m_start) <= 0.0_wp) .and. all(abs(q - q_start) <= 0.0_wp))
        end subroutine refused

    end subroutine test_refused

end module frb_test_groups
