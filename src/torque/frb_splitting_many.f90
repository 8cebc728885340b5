!> The run of n bodies that interact: see frb_splitting.
module frb_splitting_many
    use frb_exact_updates, only: turn_state, kick_state
    use frb_flow_bodies, only: flow_many
    use frb_free_flow, only: core_of, rigid_body
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_modified_kicks, only: inverse_inertia, turned
    use frb_rotations, only: cross, is_unit_quat
    use frb_schemes, only: splitting_scheme
    use frb_splitting_plan, only: splitting_plan, run_basis, new_basis, check_run
    use frb_status, only: return_or_stop, status_ok, status_bad_attitude, status_bad_count, &
        status_bad_momentum, status_bad_torque, status_not_offered, status_stopped
    use frb_torque, only: group_scene, group_observer, body_drift
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: integrate_group

    !> Momenta (3, n) and attitudes (4, n), in a compensated run with their rounding errors and the turns of a
    !> drift, and the state at the last whole step.
    type :: moving
        type(run_basis) :: basis
        real(wp), allocatable :: m(:, :), q(:, :), tau(:, :)
        real(wp), allocatable :: m_rest(:, :), q_rest(:, :), m_new(:, :), turn(:, :)
        real(wp), allocatable :: kept_m(:, :), kept_q(:, :), kept_m_rest(:, :), kept_q_rest(:, :)
        real(wp), allocatable :: n(:, :), g(:, :), other(:, :), q_turned(:, :)  ! see frb_modified_kicks
        real(wp), allocatable :: response(:, :, :)              ! I^-1 of each core, body frame
        type(body_core), allocatable :: core(:)
        type(rigid_body), pointer :: body(:) => null()          !! n, or one for all
        class(group_scene), pointer :: scene => null()
        class(group_observer), pointer :: observer => null()
        class(body_drift), pointer :: drift => null()           !! null: the free flow, in a batch
    end type moving

contains

    !> n bodies, each with moments of its own.
    subroutine integrate_group(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                               compensated, rests, joined, stat)
        type(rigid_body), intent(in), target :: body(:)             !! n bodies, or one for all
        type(splitting_scheme), intent(in) :: scheme
        class(group_scene), intent(inout), target :: scene          !! the torques
        real(wp), intent(in) :: h                                   !! step, of either sign, not zero
        integer(int64), intent(in) :: nsteps                        !! number of steps, >= 0
        real(wp), contiguous, intent(inout) :: m(:, :)              !! angular momenta (3, n), body frames
        real(wp), contiguous, intent(inout) :: q(:, :)              !! attitudes (4, n), unit quaternions
        class(group_observer), intent(inout), optional, target :: observer  !! at start, every `every` steps
        integer, intent(in), optional :: every                      !! >= 1, default 1
        real(wp), intent(inout), optional :: t                      !! time, goes on by nsteps*h; from 0
        class(body_drift), intent(in), optional, target :: drift    !! default: the free flow, in a batch
        logical, intent(in), optional :: compensated                !! default: .false.
        real(wp), intent(inout), optional :: rests(:, :)    !! (7, n): rounding errors of m and q; from 0
        logical, intent(in), optional :: joined                     !! default: .false.
        integer, intent(out), optional :: stat                      !! status code
        type(splitting_plan) :: plan
        type(moving) :: run
        real(wp) :: time
        integer :: body_status, code, spacing, i, n

        body_status = status_ok
        do i = 1, size(body)
            if (body_status == status_ok) body_status = body(i)%status()
        end do
        call check_run(body_status, scheme, h, nsteps, spacing, time, code, every, t)
        if (code == status_ok) code = check_group(size(body), m, q)
        if (code == status_ok .and. present(rests)) code = check_rests(rests, size(m, 2))
        call scene%agree(code)
        if (code == status_ok) then
            n = size(m, 2)
            plan = splitting_plan(scheme, h)
            run%basis = new_basis(scheme, plan, h, compensated, joined)
            run%m = m
            run%q = q
            allocate (run%tau(3, n), source=0.0_wp)
            allocate (run%kept_m(3, n), run%kept_q(4, n))
            if (run%basis%compensated) then
                allocate (run%m_rest(3, n), run%m_new(3, n), run%q_rest(4, n), run%turn(4, n), source=0.0_wp)
                allocate (run%kept_m_rest(3, n), run%kept_q_rest(4, n))
                if (present(rests)) then
                    run%m_rest(:, :) = rests(1:3, :)
                    run%q_rest(:, :) = rests(4:7, :)
                end if
            end if
            run%body => body
            run%core = core_of(body)
            run%scene => scene
            if (present(observer)) run%observer => observer
            if (present(drift)) run%drift => drift
            if (scheme%has_modified_kicks()) then
                allocate (run%n(3, n), run%g(3, n), run%other(3, n), run%q_turned(4, n), source=0.0_wp)
                allocate (run%response(3, 3, size(body)))
                do i = 1, size(body)
                    run%response(:, :, i) = inverse_inertia(run%core(i))
                end do
            end if
            call run_steps(run, plan, h, nsteps, spacing, time, code)
            m = run%m
            q = run%q
            if (present(t)) t = time
            if (present(rests) .and. run%basis%compensated) then
                rests(1:3, :) = run%m_rest
                rests(4:7, :) = run%q_rest
            end if
        end if
        call return_or_stop(code, 'integrate', stat)
    end subroutine integrate_group

    !> The torques, and whether they are finite and their kicks do not overflow.
    subroutine ask_torque(run, time, code)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: time
        integer, intent(out) :: code

        call run%scene%torques(run%q, time, run%tau, code)
        if (code == status_ok) then
            if (.not. all_within(size(run%tau), run%tau, run%basis%largest_torque)) code = status_bad_torque
        end if
    end subroutine ask_torque

    !> m + amount tau + modified g.
    pure subroutine kick(run, amount, modified)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: amount, modified
        integer :: i

        if (run%basis%compensated) then
            do i = 1, size(run%tau, 2)
                call kick_state(amount, run%tau(:, i), run%m(:, i), run%m_rest(:, i))
                if (abs(modified) > 0.0_wp) then
                    call kick_state(modified, run%g(:, i), run%m(:, i), run%m_rest(:, i))
                end if
            end do
        else
            call add_to(size(run%m), amount, run%tau, run%m)
            if (abs(modified) > 0.0_wp) call add_to(size(run%m), modified, run%g, run%m)
        end if
    end subroutine kick

    !> x + amount change, in one loop whatever the shape.
    pure subroutine add_to(count, amount, change, x)
        integer, intent(in) :: count
        real(wp), intent(in) :: amount, change(count)
        real(wp), intent(inout) :: x(count)

        x = x + amount*change
    end subroutine add_to

    !> A copy, in one loop whatever the shape.
    pure subroutine copy(count, from, to)
        integer, intent(in) :: count
        real(wp), intent(in) :: from(count)
        real(wp), intent(inout) :: to(count)

        to = from
    end subroutine copy

    !> The torques, and the torques g of a modified kick, as for one body: all bodies turn at a time.
    subroutine ask_torque_and_gradient(run, time, kick, modified, code)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: time, kick, modified
        integer, intent(inout) :: code
        integer :: i, refused

        call ask_torque(run, time, refused)
        if (code == status_ok) code = refused
        call run%scene%agree(code)
        if (code /= status_ok) return
        do i = 1, size(run%tau, 2)
            call respond(run%response(:, :, min(i, size(run%core))), run%tau(:, i), run%n(:, i))
        end do
        if (run%basis%displaced == 0) then
            call run%scene%torques_change(run%q, time, run%n, run%g, code)
            if (code == status_not_offered) run%basis%displaced = run%basis%on_request
        end if
        if (run%basis%displaced == 1) then
            run%n(:, :) = (2*(modified/kick))*run%n
            call turn_all(run, 1.0_wp)
            call run%scene%torques(run%q_turned, time, run%other, code)
        else if (run%basis%displaced == 2) then
            ! Both calls are made, whatever the first code is: other processes may take part in the torques.
            call turn_all(run, run%basis%displacement)
            call run%scene%torques(run%q_turned, time, run%g, code)
            call turn_all(run, -run%basis%displacement)
            call run%scene%torques(run%q_turned, time, run%other, refused)
            if (code == status_ok) code = refused
            if (code == status_ok) run%g(:, :) = (run%g - run%other)/(2*run%basis%displacement)
        end if
        if (code == status_ok) call finish_gradient(run, code)
        call run%scene%agree(code)
    end subroutine ask_torque_and_gradient

    !> g from the change of the torque, or the torque from one displaced, and whether all are finite and their
    !> kicks do not overflow.
    subroutine finish_gradient(run, code)
        type(moving), intent(inout) :: run
        integer, intent(inout) :: code
        integer :: i

        do i = 1, size(run%tau, 2)
            if (run%basis%displaced == 1) then
                run%tau(:, i) = run%other(:, i) + cross(run%n(:, i), run%tau(:, i))
                run%g(:, i) = 0.0_wp
            else
                call add_curvature(run%n(:, i), run%tau(:, i), run%g(:, i))
            end if
        end do
        if (.not. (all_within(size(run%tau), run%tau, run%basis%largest_torque) &
                   .and. all_within(size(run%g), run%g, run%basis%largest_gradient))) code = status_bad_torque
    end subroutine finish_gradient

    !> n = I^-1 tau, number by number and inlined: calls that return arrays would double the time of a stage.
    pure subroutine respond(response, tau, n)
        real(wp), intent(in) :: response(3, 3), tau(3)
        real(wp), intent(inout) :: n(3)

        n(1) = response(1, 1)*tau(1) + response(1, 2)*tau(2) + response(1, 3)*tau(3)
        n(2) = response(2, 1)*tau(1) + response(2, 2)*tau(2) + response(2, 3)*tau(3)
        n(3) = response(3, 1)*tau(1) + response(3, 2)*tau(2) + response(3, 3)*tau(3)
    end subroutine respond

    !> g, which comes as the change of the torque, as by gradient_torque; inlined too.
    pure subroutine add_curvature(n, tau, g)
        real(wp), intent(in) :: n(3), tau(3)
        real(wp), intent(inout) :: g(3)

        g(1) = 2*(g(1) + (n(2)*tau(3) - n(3)*tau(2)))
        g(2) = 2*(g(2) + (n(3)*tau(1) - n(1)*tau(3)))
        g(3) = 2*(g(3) + (n(1)*tau(2) - n(2)*tau(1)))
    end subroutine add_curvature

    !> The attitudes turned by `amount` times n.
    pure subroutine turn_all(run, amount)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: amount
        integer :: i

        do i = 1, size(run%q, 2)
            run%q_turned(:, i) = turned(run%q(:, i), amount*run%n(:, i))
        end do
    end subroutine turn_all

    !> The free bodies for a time h.
    subroutine advance(run, h, code)
        type(moving), intent(inout) :: run
        real(wp), intent(in) :: h
        integer, intent(out) :: code
        integer :: i

        if (.not. run%basis%compensated) then
            call advance_all(run, h, run%m, run%q, code)
        else
            run%m_new(:, :) = run%m
            run%turn(1, :) = 1.0_wp
            run%turn(2:4, :) = 0.0_wp
            call advance_all(run, h, run%m_new, run%turn, code)
            if (code == status_ok) then
                do i = 1, size(run%m, 2)
                    call turn_state(run%core(min(i, size(run%core))), run%turn(:, i), run%m(:, i), &
                                    run%m_rest(:, i), run%q(:, i), run%q_rest(:, i))
                end do
            end if
        end if
        call check_drifted(run, code)
    end subroutine advance

    !> All bodies, in place: the batch form of the free flow, or the user's drift one by one.
    subroutine advance_all(run, h, m, q, code)
        type(moving), intent(in) :: run
        real(wp), intent(in) :: h
        real(wp), contiguous, intent(inout) :: m(:, :), q(:, :)
        integer, intent(out) :: code
        integer :: i

        code = status_ok
        if (associated(run%drift)) then
            do i = 1, size(m, 2)
                call run%drift%advance(run%body(min(i, size(run%body))), h, m(:, i), q(:, i), code)
                if (code /= status_ok) return
            end do
        else
            call flow_many(run%core, size(run%core) == 1, [h], size(m, 2), m, code, q)
        end if
    end subroutine advance_all

    !> Keeps the state at the start of a step.
    subroutine keep(run)
        type(moving), intent(inout) :: run

        call copy(size(run%m), run%m, run%kept_m)
        call copy(size(run%q), run%q, run%kept_q)
        if (run%basis%compensated) then
            call copy(size(run%m_rest), run%m_rest, run%kept_m_rest)
            call copy(size(run%q_rest), run%q_rest, run%kept_q_rest)
        end if
    end subroutine keep

    !> Goes back to the state at the start of the step.
    subroutine go_back(run)
        type(moving), intent(inout) :: run

        call copy(size(run%kept_m), run%kept_m, run%m)
        call copy(size(run%kept_q), run%kept_q, run%q)
        if (run%basis%compensated) then
            call copy(size(run%kept_m_rest), run%kept_m_rest, run%m_rest)
            call copy(size(run%kept_q_rest), run%kept_q_rest, run%q_rest)
        end if
    end subroutine go_back

    !> Sizes and values of the state of a group.
    pure function check_group(bodies, m, q) result(code)
        integer, intent(in) :: bodies
        real(wp), intent(in) :: m(:, :), q(:, :)
        integer :: code
        integer :: n, i

        n = size(m, 2)
        code = status_bad_count
        if (size(m, 1) /= 3 .or. size(q, 1) /= 4 .or. size(q, 2) /= n) return
        if (bodies /= 1 .and. bodies /= n) return
        code = status_bad_momentum
        if (.not. all(ieee_is_finite(m))) return
        code = status_bad_attitude
        do i = 1, n
            if (.not. is_unit_quat(q(:, i))) return
        end do
        code = status_ok
    end function check_group

    !> The same for the rounding errors of n bodies.
    pure function check_rests(rests, n) result(code)
        real(wp), intent(in) :: rests(:, :)
        integer, intent(in) :: n
        integer :: code

        code = status_bad_count
        if (size(rests, 1) /= 7 .or. size(rests, 2) /= n) return
        code = status_bad_momentum
        if (all(ieee_is_finite(rests))) code = status_ok
    end function check_rests

    include 'next_time.inc'

    include 'splitting_steps.inc'

end module frb_splitting_many
