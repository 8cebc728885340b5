!> The drifts, kicks and times of one step of a splitting scheme, for `integrate` and for a user's own loops;
!> and the checks common to all calls of `integrate`.
module frb_splitting_plan
    use frb_kinds, only: wp
    use frb_schemes, only: splitting_scheme
    use frb_status, only: status_ok, status_bad_count, status_bad_scheme, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: splitting_plan, run_basis, new_basis, check_run, next_time

    !> h times coefficients, and start and end of a run: beyond it they could overflow.
    real(wp), parameter :: longest = 1.0e-7_wp*huge(1.0_wp)     ! coefficients are at most 1e6

    !> One step of size h of a scheme: `splitting_plan(scheme, h)`. This loop makes the step, for every
    !> scheme, here with centres of mass x and momenta p:
    !>
    !>     do i = 1, plan%stages
    !>         call free_flow(body, plan%drift(i), m, q);  x = x + plan%drift(i)*p/mass
    !>         call my_forces(x, q, t + plan%time(i), f, tau)
    !>         m = m + plan%kick(i)*tau;  p = p + plan%kick(i)*f
    !>     end do
    !>     call free_flow(body, plan%drift(i), m, q);  x = x + plan%drift(i)*p/mass     ! i is stages + 1
    !>     t = t + h
    !>
    !> `integrate` makes the same steps, to the last bit. A scheme that opens and closes with kicks (BAB) has
    !> a zero drift at both ends. Then the last torque of the step before is still valid and can be kept, with
    !> `known = .false.` before the first step:
    !>
    !>     if (abs(plan%drift(i)) > 0 .or. .not. known) call my_forces(x, q, t + plan%time(i), f, tau)
    !>     known = .true.
    !>
    !> A scheme with modified kicks adds plan%modified(i)*g to m, g = 2 (D_n tau + n x tau) as in
    !> frb_modified_kicks, and 2 D_n f to p. With moving centres D_n is the change while q turns by n = I^-1
    !> tau and x moves by f/mass.
    type :: splitting_plan
        integer :: status = status_bad_scheme   !! `status_ok`, or why there is no plan; then no stages
        integer :: stages = 0                   !! kicks in a step
        real(wp), allocatable :: drift(:)       !! (stages + 1): time of each drift
        real(wp), allocatable :: kick(:)        !! (stages): factor of each torque
        real(wp), allocatable :: time(:)        !! (stages): of each torque, from the start of the step
        real(wp), allocatable :: modified(:)    !! (stages): c h^3 of modified kicks, else 0
    end type splitting_plan

    !> Options of a run, and limits that follow from them.
    type :: run_basis
        logical :: compensated = .false.
        logical :: joined = .false.             !! two drifts between steps are one where nothing is shown
        logical :: torque_known = .false.       !! no attitude has changed since the last torque
        real(wp) :: largest_torque = 0.0_wp     !! of a torque whose kicks do not overflow
        real(wp) :: largest_gradient = 0.0_wp   !! the same of g, see frb_modified_kicks
        real(wp) :: displacement = 0.0_wp       !! displaced torques: turn by this times n
        integer :: displaced = 0                !! number of displaced torques; 0: the scene has the change
        integer :: on_request = 2               !! number of displaced torques if the scene has no change
    end type run_basis

    !> The plan of a step: `plan = splitting_plan(scheme, h [, stat])`.
    interface splitting_plan
        module procedure plan_of_step
        module procedure plan_of_step_with_stat
    end interface splitting_plan

contains

    !> The plan of a step of size h, of either sign. `status`: that of a scheme that could not be made;
    !> `status_bad_time` for h zero, not finite or beyond 1e301 (1e100 with modified kicks).
    pure function plan_of_step(scheme, h) result(plan)
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        type(splitting_plan) :: plan
        real(wp) :: a, passed
        integer :: i, s, first, centre

        plan%status = scheme%status
        if (plan%status == status_ok .and. .not. is_step(scheme, h)) plan%status = status_bad_time
        s = 0
        if (plan%status == status_ok) s = scheme%kicks
        plan%stages = s
        allocate (plan%drift(s + 1), source=0.0_wp)
        allocate (plan%kick(s), plan%time(s), plan%modified(s), source=0.0_wp)
        if (s == 0) return
        ! From the halves: an array of all coefficients would be one more to allocate, in a call that may make
        ! one step only.
        do i = 1, s
            centre = min(i, s + 1 - i)
            plan%kick(i) = scheme%half_b(centre)*h
            plan%modified(i) = scheme%half_c(centre)*h*h*h
        end do
        first = merge(0, 1, scheme%drift_first)
        passed = 0.0_wp
        do i = 1, scheme%drifts
            a = scheme%half_a(min(i, scheme%drifts + 1 - i))
            passed = passed + a
            plan%drift(first + i) = a*h
            if (first + i <= s) plan%time(first + i) = passed*h
        end do
        if (.not. scheme%drift_first) plan%time(s) = h
    end function plan_of_step

    !> The same, with its status in `stat` too.
    function plan_of_step_with_stat(scheme, h, stat) result(plan)
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        integer, intent(out) :: stat
        type(splitting_plan) :: plan

        plan = plan_of_step(scheme, h)
        stat = plan%status
    end function plan_of_step_with_stat

    !> Whether h can be a step; h**3 must not overflow where there are modified kicks.
    pure function is_step(scheme, h) result(good)
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        logical :: good
        real(wp), parameter :: longest_cubed = 1.0e100_wp

        good = ieee_is_finite(h)
        if (good) good = abs(h) > 0.0_wp .and. abs(h) <= longest
        if (good .and. scheme%has_modified_kicks()) good = abs(h) <= longest_cubed
    end function is_step

    include 'next_time.inc'

    !> The basis of a run of steps of size h.
    pure function new_basis(scheme, plan, h, compensated, joined) result(basis)
        type(splitting_scheme), intent(in) :: scheme
        type(splitting_plan), intent(in) :: plan
        real(wp), intent(in) :: h
        logical, intent(in), optional :: compensated, joined
        type(run_basis) :: basis
        real(wp), parameter :: largest = 0.1_wp*huge(1.0_wp)

        if (present(compensated)) basis%compensated = compensated
        if (present(joined)) basis%joined = joined
        basis%largest_torque = largest/max(1.0_wp, maxval(abs(plan%kick)))
        basis%largest_gradient = largest/max(1.0_wp, maxval(abs(plan%modified)))
        if (any(abs(plan%modified) > 0.0_wp)) basis%displacement = 0.25_wp*h*h
        basis%on_request = scheme%displaced
    end function new_basis

    !> The checks common to all calls, and defaults: `code` is that of the first error.
    pure subroutine check_run(body_status, scheme, h, nsteps, spacing, start, code, every, t)
        integer, intent(in) :: body_status
        type(splitting_scheme), intent(in) :: scheme
        real(wp), intent(in) :: h
        integer(int64), intent(in) :: nsteps
        integer, intent(out) :: spacing
        real(wp), intent(out) :: start
        integer, intent(out) :: code
        integer, intent(in), optional :: every
        real(wp), intent(in), optional :: t

        spacing = 1
        if (present(every)) spacing = every
        start = 0.0_wp
        if (present(t)) start = t
        code = body_status
        if (code == status_ok) code = scheme%status
        if (code == status_ok .and. (nsteps < 0 .or. spacing < 1)) code = status_bad_count
        if (code == status_ok) then
            code = status_bad_time
            if (is_step(scheme, h) .and. ieee_is_finite(start)) then
                if (abs(h) <= longest/max(nsteps, 1_int64) .and. abs(start) <= longest) code = status_ok
            end if
        end if
    end subroutine check_run

end module frb_splitting_plan
