!> The loop of steps and stages, stated once for one body and for many: see frb_splitting.
module frb_splitting_run
    use frb_kinds, only: wp
    use frb_splitting_plan, only: splitting_plan, next_time
    use frb_status, only: status_ok
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: splitting_run, run_steps, largest_momentum

    !> Momenta below this and kicks below this add up without overflow.
    real(wp), parameter :: largest_momentum = 0.1_wp*huge(1.0_wp)

    !> A run of one body or of many, its state and whoever acts on it.
    type, abstract :: splitting_run
        logical :: compensated = .false.
        logical :: torque_known = .false.       !! nothing has moved since the last torque
        real(wp) :: largest_torque = 0.0_wp     !! of a torque whose kicks do not overflow
        real(wp) :: largest_gradient = 0.0_wp   !! the same of g, see frb_modified_kicks
        real(wp) :: reach = 0.0_wp              !! displaced torques: turn by this times n
        integer :: displaced = 0                !! how many of them; 0: the scene tells the change
        integer :: on_request = 2               !! how many if it does not
    contains
        procedure(one_stage), deferred :: stage
        procedure(one_drift), deferred :: move
        procedure(on_state), deferred :: keep
        procedure(on_state), deferred :: go_back
        procedure(on_watched_state), deferred :: show
    end type splitting_run

    abstract interface
        !> Drift, torque at `time` unless it is known, kick, a modified one where `modified` is not 0. What
        !> the code says has been agreed on: one code for all three; a drift of the user's, which may leave
        !> no valid state behind, and a modified kick have their own.
        subroutine one_stage(self, drift, time, kick, modified, code)
            import :: splitting_run, wp
            implicit none
            class(splitting_run), intent(inout) :: self
            real(wp), intent(in) :: drift, time, kick, modified
            integer, intent(out) :: code
        end subroutine one_stage

        !> The drift that closes a step; what the code says has been agreed on.
        subroutine one_drift(self, h, code)
            import :: splitting_run, wp
            implicit none
            class(splitting_run), intent(inout) :: self
            real(wp), intent(in) :: h
            integer, intent(out) :: code
        end subroutine one_drift

        !> Keeps the state of a whole step, or goes back to it.
        subroutine on_state(self)
            import :: splitting_run
            implicit none
            class(splitting_run), intent(inout) :: self
        end subroutine on_state

        !> Shows the state to the observer; code: `status_stopped` if it has seen enough.
        subroutine on_watched_state(self, step, t, code)
            import :: splitting_run, int64, wp
            implicit none
            class(splitting_run), intent(inout) :: self
            integer(int64), intent(in) :: step
            real(wp), intent(in) :: t
            integer, intent(out) :: code
        end subroutine on_watched_state
    end interface

contains

    !> Steps from time t until all are done or something ends the run; t and the state are then those of the
    !> last whole step.
    subroutine run_steps(run, plan, h, nsteps, watched, spacing, t, code)
        class(splitting_run), intent(inout) :: run
        type(splitting_plan), intent(in) :: plan
        real(wp), intent(in) :: h
        integer(int64), intent(in) :: nsteps
        logical, intent(in) :: watched          ! there is an observer
        integer, intent(in) :: spacing          ! steps from one state shown to the next
        real(wp), intent(inout) :: t
        integer, intent(out) :: code
        real(wp) :: t_next, time, last_drift
        integer(int64) :: step, next_shown
        integer :: i, s

        s = plan%stages
        last_drift = plan%drift(s + 1)
        next_shown = huge(nsteps)
        run%largest_torque = largest_momentum/max(1.0_wp, maxval(abs(plan%kick)))
        run%largest_gradient = largest_momentum/max(1.0_wp, maxval(abs(plan%modified)))
        run%reach = 0.25_wp*h*h
        code = status_ok
        if (watched) then
            next_shown = spacing
            call run%show(0_int64, t, code)
        end if
        do step = 1, nsteps
            if (code /= status_ok) exit
            call run%keep()
            t_next = next_time(t, h)
            do i = 1, s
                time = t + plan%time(i)
                ! Where no drift follows, the torque of the last stage is the next step's first.
                if (i == s .and. .not. abs(last_drift) > 0.0_wp) time = t_next
                call run%stage(plan%drift(i), time, plan%kick(i), plan%modified(i), code)
                if (code /= status_ok) exit
            end do
            if (code == status_ok .and. abs(last_drift) > 0.0_wp) call run%move(last_drift, code)
            if (code /= status_ok) then
                call run%go_back()
                exit
            end if
            t = t_next
            if (step == next_shown) then
                next_shown = next_shown + spacing
                call run%show(step, t, code)
            end if
        end do
    end subroutine run_steps

end module frb_splitting_run
