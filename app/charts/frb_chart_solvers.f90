!> The solvers of heavy tops that the charts compare: splittings by scheme and drift, the extrapolated
!> splitting, and two solvers of the plain equations, each with nine settings from coarse to fine. With the
!> free flow the last drift of a step and the first of the next are made as one (`joined`).
module frb_chart_solvers
    use frb, only: wp, rigid_body, splitting_scheme, heavy_top, body_drift, body_scene, integrate, &
        extrapolate, extrapolation_report, status_ok
    use frb_chart_methods, only: method, find_method, known, escaped, advance_once, family_dmv
    use frb_chart_timing, only: clock
    use frb_dmv, only: dmv_body, new_dmv_body, dmv_steps
    use frb_top_rivals, only: dormand_prince_steps, midpoint_lanes, torques_of_midpoint
    implicit none
    private

    public :: solver, top_at_start, all_solvers, name_of, setting_of, run_solver, settings_of_solver
    public :: start_q, one_top, papers_top

    integer, parameter :: settings_of_solver = 9
    real(wp), parameter :: start_q(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]

    !> A solver, and how it is drawn: `with` is a scheme, or the solver itself where `drift` is empty.
    type :: solver
        character(16) :: with = ''
        character(12) :: drift = ''
        integer :: colour = 1, dash = 1, symbol = 7, width = 2
    end type solver

    !> A heavy top at its start, and the step with which a solver of order 14 has an error of about 1e-9.
    type :: top_at_start
        character(8) :: name = ''
        character(60) :: title = ''
        real(wp) :: moments(3) = 1.0_wp, force(3) = 0.0_wp, m0(3) = 0.0_wp
        real(wp) :: step = 1.0_wp
        real(wp) :: q0(4) = start_q
    end type top_at_start

    !> A heavy top that gives its torque for one attitude at a time.
    type, extends(body_scene) :: plain_top
        type(heavy_top) :: top
    contains
        procedure :: torque => plain_torque
    end type plain_top

    !> A drift by any method of the catalogue; the rival's constants are set up once.
    type, extends(body_drift) :: catalogue_drift
        type(method) :: with
        type(dmv_body) :: rival
    contains
        procedure :: advance => advance_drift
    end type catalogue_drift

contains

    !> 1: Hairer and Vilmart's top, whose torque is strong; 2: the paper's, whose torque is weak.
    pure function one_top(number) result(top)
        integer, intent(in) :: number
        type(top_at_start) :: top

        if (number == 1) then
            top = top_at_start('strong', 'Hairer-Vilmart top (0.6, 0.8, 1)', [0.6_wp, 0.8_wp, 1.0_wp], &
                               [0.0_wp, 0.0_wp, 1.0_wp], [1.8_wp, 0.4_wp, -0.9_wp], 0.5_wp)
        else
            top = papers_top()
        end if
    end function one_top

    !> The paper's heavy top, section 4.3.
    pure function papers_top() result(top)
        type(top_at_start) :: top

        top = top_at_start('weak', 'the paper''s top, |V| = 0.001', &
                           [1.0_wp, 1.0126869887825154_wp, 3.3062374224730378_wp], &
                           [9.5586303547238536e-5_wp, 4.8777318247201465e-4_wp, -8.6772148817192390e-4_wp], &
                           [-0.34790957088547336_wp, -0.19822914599675923_wp, -0.91633189192763642_wp], &
                           4.0_wp)
    end function papers_top

    function all_solvers() result(solvers)
        type(solver), allocatable :: solvers(:)
        type(solver), parameter :: everything(*) = [ &
            solver('srkn6', 'flow', 7, 1, 11, 2), solver('srkn14', 'flow', 8, 1, 7, 2), &
            solver('srkn17', 'flow', 4, 1, 13, 2), solver('aba864', 'flow', 5, 1, 15, 2), &
            solver('fg6a', 'flow', 6, 1, 5, 3), solver('fg6b', 'flow', 3, 1, 9, 3), &
            solver('fg8', 'flow', 4, 3, 11, 2), solver('extrapolate', '', 2, 1, 7, 5), &
            solver('dop853', '', 1, 1, 5, 3), solver('midpoint, lanes', '', 1, 2, 4, 2), &
            solver('strang', 'dmv10', 8, 2, 6, 2), solver('srkn14', 'dmv10', 8, 3, 8, 2)]
        integer :: i

        allocate (solvers, source=pack(everything, [(is_there(everything(i)), i=1, size(everything))]))
    end function all_solvers

    !> Whether a solver's drift is in this build.
    function is_there(which) result(there)
        type(solver), intent(in) :: which
        logical :: there

        there = which%drift == ''
        if (.not. there) there = known(which%drift)
    end function is_there

    !> The solver's name in a legend.
    function name_of(which) result(name)
        type(solver), intent(in) :: which
        character(:), allocatable :: name

        name = trim(which%with)
        if (which%drift == 'flow') then
            name = name//', free flow'
        else if (which%drift /= '') then
            name = name//', '//escaped(which%drift)
        end if
    end function name_of

    !> The k-th setting of nine: a tolerance, or a step.
    pure function setting_of(which, top, k) result(setting)
        type(solver), intent(in) :: which
        type(top_at_start), intent(in) :: top
        integer, intent(in) :: k
        real(wp) :: setting
        type(splitting_scheme) :: scheme

        select case (which%with)
        case ('extrapolate', 'scalar torque', 'dop853')
            setting = 10.0_wp**(-2 - 1.5_wp*(k - 1))
        case ('midpoint, lanes')
            setting = 4*top%step*0.72_wp**k
        case default
            scheme = splitting_scheme(trim(which%with))
            setting = 0.4_wp*top%step*scheme%stages()*0.58_wp**k
        end select
    end function setting_of

    !> Integrates a top `rounds` times, each time from its start. `torques` counts the torques of one round;
    !> the change of a torque counts as one torque more.
    subroutine run_solver(which, top, duration, setting, rounds, m, q, seconds, torques)
        type(solver), intent(in) :: which
        type(top_at_start), intent(in) :: top
        real(wp), intent(in) :: duration, setting
        integer, intent(in) :: rounds
        real(wp), intent(out) :: m(3), q(4), seconds, torques
        type(catalogue_drift) :: drift
        type(splitting_scheme) :: scheme
        type(extrapolation_report) :: report
        type(heavy_top) :: scene
        type(plain_top) :: plain
        type(rigid_body) :: body
        real(wp) :: start, constants(6)
        integer :: pass, stat, steps

        body = rigid_body(top%moments)
        scene%force = top%force
        plain%top = scene
        constants = [1/top%moments, top%force]
        stat = status_ok
        torques = 0.0_wp
        steps = max(1, nint(duration/setting))
        if (which%drift /= '') then
            scheme = splitting_scheme(trim(which%with))
            torques = real(steps, wp)*(scheme%stages() + count(abs(scheme%modified_coefficients()) > 0.0_wp))
            drift%with = find_method(trim(which%drift))
            drift%rival = new_dmv_body(top%moments)
        end if
        start = clock(.false.)
        do pass = 1, rounds
            m = top%m0
            q = top%q0
            select case (which%with)
            case ('extrapolate')
                call extrapolate(body, scene, duration, m, q, setting, stat=stat, report=report)
                torques = real(report%torques, wp)
            case ('scalar torque')
                call extrapolate(body, plain, duration, m, q, setting, stat=stat, report=report)
                torques = real(report%torques, wp)
            case ('dop853')
                call dormand_prince_steps(constants, duration, setting, m, q, steps)
                torques = 12.0_wp*steps
            case ('midpoint, lanes')
                call midpoint_lanes(constants, duration, steps, m, q)
                torques = real(torques_of_midpoint, wp)*steps
            case default
                if (which%drift == 'flow') then
                    call integrate(body, scheme, scene, duration/steps, steps, m, q, joined=.true., stat=stat)
                else
                    call integrate(body, scheme, scene, duration/steps, steps, m, q, drift=drift, stat=stat)
                end if
            end select
        end do
        seconds = (clock(.false.) - start)/rounds
        if (stat /= status_ok) q = 1.0_wp
    end subroutine run_solver

    !> The torque of the top.
    subroutine plain_torque(self, q, t, tau, stat)
        class(plain_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        call self%top%torque(q, t, tau, stat)
    end subroutine plain_torque

    !> One drift by the method.
    subroutine advance_drift(self, body, h, m, q, stat)
        class(catalogue_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat

        if (self%with%family == family_dmv) then
            call dmv_steps(self%rival, self%with%option, h, 1, m, q)
            stat = status_ok
        else
            call advance_once(self%with, body%moments(), h, m, q, stat)
        end if
    end subroutine advance_drift

end module frb_chart_solvers
