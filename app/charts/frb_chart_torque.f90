!> The tables `torque-cost` and `torque-reversal`: cost of the splitting loop against that of its drifts and
!> kicks, conserved quantities of the paper's long run, and how well runs there and back return.
module frb_chart_torque
    use frb, only: wp, rigid_body, body_drift, body_observer, drift_by_name, free_flow, heavy_top, &
        integrate, scheme_names, splitting_plan, splitting_scheme, status_ok, total_energy
    use frb_chart_dipoles, only: cost_of_dipoles, row
    use frb_chart_output, only: chart_file, settings, open_table, progress
    use frb_chart_solvers, only: top_at_start, papers_top
    use frb_chart_timing, only: clock
    use frb_dmv, only: dmv_body, new_dmv_body, dmv_steps
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: chart_torque

    !> A heavy top and its start.
    type :: placed_top
        character(10) :: name = ''
        type(rigid_body) :: body
        type(heavy_top) :: top
        real(wp) :: m0(3) = [1.8_wp, 0.4_wp, -0.9_wp]
    end type placed_top

    !> Keeps the energy of every state it is shown.
    type, extends(body_observer) :: energy_keeper
        type(placed_top) :: item
        integer :: count = 0
        real(wp) :: energy(0:1000) = 0.0_wp
    contains
        procedure :: observe => keep_energy
    end type energy_keeper

    !> Discrete Moser-Veselov, its constants set up once.
    type, extends(body_drift) :: dmv_drift
        type(dmv_body) :: constants
    contains
        procedure :: advance => advance_by_dmv
    end type dmv_drift

    real(wp), parameter :: start_q(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]

contains

    subroutine chart_torque(options)
        type(settings), intent(in) :: options
        type(chart_file) :: file

        call open_table(options, 'torque-cost', 'the splitting loop: the paper''s heavy top, srkn14, '// &
            'h = 0.5, and dipoles', 'what, median, quartiles', file)
        call cost_of_a_step(options, file)
        call long_run(options, file)
        call time_to_ten_digits(options, file)
        call cost_of_dipoles(options, file)
        call file%finish()
        call open_table(options, 'torque-reversal', '10 000 steps there and back: distance from the '// &
            'start; growth: of a small change of the start by the turning point, as roundings grow too', &
            'top, scheme, h, plain, compensated, growth', file)
        call reversal(options, file)
        call file%finish()
    end subroutine chart_torque

    pure function top_number(number) result(item)
        integer, intent(in) :: number
        type(placed_top) :: item
        type(top_at_start) :: paper

        select case (number)
        case (1)
            paper = papers_top()
            item%name = 'paper'
            item%body = rigid_body(paper%moments)
            item%top%force = paper%force
            item%m0 = paper%m0
        case (2)
            item%name = 'asymmetric'
            item%body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        case default
            item%name = 'flat'
            item%body = rigid_body([0.345_wp, 0.653_wp, 1.0_wp])
        end select
    end function top_number

    !> A step of srkn14 against its 14 drifts and 14 kicks done by hand, all drifts before all kicks and one
    !> after the other, and with other drifts.
    subroutine cost_of_a_step(options, file)
        type(settings), intent(in) :: options
        type(chart_file), intent(inout) :: file
        real(wp), parameter :: h = 0.5_wp
        character(9), parameter :: names(4) = ['free_flow', 'free_flow', 'frb_step ', 'quat_step']
        type(placed_top) :: item
        type(splitting_scheme) :: scheme
        class(body_drift), allocatable :: drift
        ! Drifts, kicks, loop, compensated loop, frb_step, quat_step, drifts and kicks in turn.
        real(wp), allocatable :: ns(:, :)
        type(splitting_plan) :: plan
        real(wp) :: m(3), q(4), tau(3), start
        integer :: repetitions, steps, r, n, i, stat

        item = top_number(1)
        scheme = splitting_scheme('srkn14')
        plan = splitting_plan(scheme, h)
        repetitions = merge(9, 51, options%quick)
        steps = 1000
        allocate (ns(repetitions, 7))
        do r = 1, repetitions
            m = item%m0
            q = start_q
            start = clock(.false.)
            do n = 1, steps
                do i = 1, 15
                    call free_flow(item%body, plan%drift(i), m, q, stat)
                end do
            end do
            ns(r, 1) = clock(.false.) - start
            start = clock(.false.)
            do n = 1, steps
                do i = 1, 14
                    call item%top%torque(q, 0.0_wp, tau, stat)
                    m = m + plan%kick(i)*tau
                end do
            end do
            ns(r, 2) = clock(.false.) - start
            m = item%m0
            q = start_q
            start = clock(.false.)
            do n = 1, steps
                do i = 1, plan%stages
                    call free_flow(item%body, plan%drift(i), m, q, stat)
                    call item%top%torque(q, 0.0_wp, tau, stat)
                    m = m + plan%kick(i)*tau
                end do
                call free_flow(item%body, plan%drift(plan%stages + 1), m, q, stat)
            end do
            ns(r, 7) = clock(.false.) - start
            do i = 1, 4
                call drift_by_name(trim(names(i)), drift)
                m = item%m0
                q = start_q
                start = clock(.false.)
                if (i < 3) then
                    call integrate(item%body, scheme, item%top, h, steps, m, q, compensated=i == 2, stat=stat)
                else
                    call integrate(item%body, scheme, item%top, h, steps, m, q, drift=drift, stat=stat)
                end if
                ns(r, 2 + i) = clock(.false.) - start
            end do
            call progress(options, 'torque-cost', r, repetitions)
        end do
        ns = ns*1.0e9_wp/steps
        call row(file, '15 drifts [ns]', ns(:, 1))
        call row(file, '14 kicks [ns]', ns(:, 2))
        call row(file, 'a step [ns]', ns(:, 3))
        call row(file, 'a step / (15 drifts + 14 kicks)', ns(:, 3)/(ns(:, 1) + ns(:, 2)))
        call row(file, 'a step / the same loop of one''s own', ns(:, 3)/ns(:, 7))
        call row(file, 'a compensated step / a step', ns(:, 4)/ns(:, 3))
        do i = 3, 4
            call row(file, 'a step with '//trim(names(i))//' / a step', ns(:, 2 + i)/ns(:, 3))
        end do
    end subroutine cost_of_a_step

    !> T = 5e4 in 1e5 steps: time, energy, and the change of its line of best fit over the last nine tenths.
    subroutine long_run(options, file)
        type(settings), intent(in) :: options
        type(chart_file), intent(inout) :: file
        character(12), parameter :: names(2) = [character(12) :: 'plain', 'compensated']
        type(energy_keeper) :: keeper
        type(splitting_scheme) :: scheme
        class(body_drift), allocatable :: drift
        real(wp) :: m(3), q(4), m_other(3), q_other(4), start, seconds, late(900)
        integer :: i

        keeper%item = top_number(1)
        scheme = splitting_scheme('srkn14')
        late = [(i - 450.5_wp, i=1, 900)]
        do i = 1, 2
            m = keeper%item%m0
            q = start_q
            keeper%count = 0
            start = clock(.false.)
            call integrate(keeper%item%body, scheme, keeper%item%top, 0.5_wp, 100000, m, q, keeper, &
                           every=100, compensated=i == 2)
            seconds = clock(.false.) - start
            call row(file, trim(names(i))//' run to T = 5e4 [s]', [seconds])
            call row(file, trim(names(i))//' run: largest error of the energy', &
                     [maxval(abs(keeper%energy - keeper%energy(0)))])
            call row(file, trim(names(i))//' run: fitted change over the last nine tenths', &
                     [900*sum(late*keeper%energy(101:1000))/sum(late**2)])
        end do
        if (options%quick) return
        call drift_by_name('frb_step', drift)
        m_other = keeper%item%m0
        q_other = start_q
        call integrate(keeper%item%body, scheme, keeper%item%top, 0.5_wp, 100000, m_other, q_other, &
                       drift=drift)
        call row(file, 'frb_step against the free flow, distance at T = 5e4', &
                 [distance(m, q, m_other, q_other)])
        m_other = keeper%item%m0 + [1.0e-9_wp, 0.0_wp, 0.0_wp]
        q_other = start_q
        call integrate(keeper%item%body, scheme, keeper%item%top, 0.5_wp, 100000, m_other, q_other, &
                       compensated=.true.)
        call row(file, 'growth of a small change of the start by T = 5e4', &
                 [distance(m, q, m_other, q_other)*1.0e9_wp])
    end subroutine long_run

    !> The paper's top to t = 100 with an error of 1e-10, as few steps as that takes (48, 72,
    !> 96, 144, ...): Strang as kick-drift-kick with Moser-Veselov of order 10 against schemes of higher order
    !> with the free flow.
    subroutine time_to_ten_digits(options, file)
        type(settings), intent(in) :: options
        type(chart_file), intent(inout) :: file
        real(wp), parameter :: t = 100.0_wp, bound = 1.0e-10_wp
        character(8), parameter :: names(2) = [character(8) :: 'srkn14', 'aba864']
        type(placed_top) :: item
        type(splitting_scheme) :: schemes(3)
        type(dmv_drift) :: rival
        real(wp) :: m_end(3), q_end(4), m(3), q(4), start
        real(wp), allocatable :: seconds(:, :)
        integer :: steps(3), repetitions, rounds, pass, i, k, r, stat

        item = top_number(1)
        rival%constants = new_dmv_body(item%body%moments())
        schemes(1) = splitting_scheme([1.0_wp], [0.5_wp, 0.5_wp])
        schemes(2) = splitting_scheme(names(1))
        schemes(3) = splitting_scheme(names(2))
        m_end = item%m0
        q_end = start_q
        call integrate(item%body, schemes(2), item%top, t/4000, 4000, m_end, q_end, compensated=.true.)
        do i = 1, 3
            steps(i) = 48
            do k = 1, 60
                call run_to_end(i)
                if (stat == status_ok) then
                    if (distance(m, q, m_end, q_end) <= bound) exit
                end if
                steps(i) = merge(steps(i)/2*3, steps(i)/3*4, mod(k, 2) == 1)
            end do
        end do
        repetitions = merge(3, 15, options%quick)
        allocate (seconds(repetitions, 3))
        do r = 1, repetitions
            do i = 1, 3
                rounds = max(1, 20000/steps(i))
                start = clock(.false.)
                do pass = 1, rounds
                    call run_to_end(i)
                end do
                seconds(r, i) = (clock(.false.) - start)/rounds
            end do
        end do
        do i = 2, 3
            call row(file, 'time to 1e-10: Strang with DMV10 / '//trim(names(i - 1))//' with the free flow', &
                     seconds(:, 1)/seconds(:, i))
        end do

    contains

        subroutine run_to_end(which)
            integer, intent(in) :: which

            m = item%m0
            q = start_q
            if (which == 1) then
                call integrate(item%body, schemes(1), item%top, t/steps(1), steps(1), m, q, drift=rival, &
                               stat=stat)
            else
                call integrate(item%body, schemes(which), item%top, t/steps(which), steps(which), m, q, &
                               stat=stat)
            end if
        end subroutine run_to_end

    end subroutine time_to_ten_digits

    !> Moser-Veselov of order 10.
    subroutine advance_by_dmv(self, body, h, m, q, stat)
        class(dmv_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat

        stat = body%status()
        call dmv_steps(self%constants, 10, h, 1, m, q)
    end subroutine advance_by_dmv

    !> There and back with every scheme.
    subroutine reversal(options, file)
        type(settings), intent(in) :: options
        type(chart_file), intent(inout) :: file
        integer, parameter :: steps = 10000
        real(wp), parameter :: sizes(4) = [0.001_wp, 0.01_wp, 0.1_wp, 0.5_wp]
        real(wp), parameter :: small = 1.0e-9_wp
        type(placed_top) :: item
        type(splitting_scheme) :: scheme
        real(wp) :: m(3), q(4), m_end(3), q_end(4), back(2), growth
        integer :: tops, number, j, k, i

        tops = merge(1, 3, options%quick)
        do number = 1, tops
            item = top_number(number)
            do j = 1, size(sizes)
                do k = 1, size(scheme_names)
                    scheme = splitting_scheme(trim(scheme_names(k)))
                    do i = 1, 2
                        m_end = item%m0
                        q_end = start_q
                        call integrate(item%body, scheme, item%top, sizes(j), steps, m_end, q_end, &
                                       compensated=i == 2)
                        m = m_end
                        q = q_end
                        call integrate(item%body, scheme, item%top, -sizes(j), steps, m, q, &
                                       compensated=i == 2)
                        back(i) = distance(m, q, item%m0, start_q)
                    end do
                    m = item%m0 + [small, 0.0_wp, 0.0_wp]
                    q = start_q
                    call integrate(item%body, scheme, item%top, sizes(j), steps, m, q, compensated=.true.)
                    growth = distance(m, q, m_end, q_end)/small
                    write (file%line, '(2a12,f8.3,3es11.2)') item%name, scheme_names(k), sizes(j), back, &
                        growth
                    call file%put()
                end do
            end do
            call progress(options, 'torque-reversal', number, tops)
        end do
    end subroutine reversal

    !> Distance of two states, Euclidean; q and -q are the same attitude.
    pure function distance(m, q, m_other, q_other) result(d)
        real(wp), intent(in) :: m(3), q(4), m_other(3), q_other(4)
        real(wp) :: d

        d = sqrt(sum((m - m_other)**2) + min(sum((q - q_other)**2), sum((q + q_other)**2)))
    end function distance

    subroutine keep_energy(self, step, t, m, q, stop)
        class(energy_keeper), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t, m(3), q(4)
        logical, intent(inout) :: stop

        associate (unused => step, unused_stop => stop)
        end associate
        self%energy(self%count) = total_energy(self%item%body, self%item%top, t, m, q)
        self%count = self%count + 1
    end subroutine keep_energy

end module frb_chart_torque
