!> Kick and drift of four lanes at a time, each with a step of its own: the formulas of the free flow for
!> short steps, compensated, which costs 2 % here, in a loop that the compiler turns into one vector.
!>
!> The series are those of one_step.inc, and end at degree 6 in the squares of the frequencies times t: beyond
!> short_limit a drift is no longer exact, but an approximation of order 12.
module frb_extrapolation_lanes
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_torque, only: scene_lanes
    implicit none
    private

    public :: lanes, state_of_lanes, form_of_step, chosen_form, start_lanes, end_sequences, kick_and_drift, &
        kick_and_drift_few

    !> One of the two forms of the turn: axes of the body in the order of the formulas, the third axis
    !> reversed if necessary to make them right-handed, and the constants of the body in these axes. The
    !> mirror form is the first form with descending moments: alpha, beta, gamma are then negative.
    type :: form_of_step
        integer :: axis(3) = [1, 2, 3]
        real(wp) :: sign3 = 1.0_wp
        real(wp) :: alpha = 0.0_wp, beta = 0.0_wp, gamma = 0.0_wp, a1 = 0.0_wp
    end type form_of_step

    integer, parameter :: lanes = 4     !! sequences advanced at a time

    !> The lanes of a step that is tried; m in the axes of the form, other vectors in body axes. A scene
    !> computes torques for scene_lanes attitudes: attitudes beyond `lanes` repeat the first ones.
    type :: state_of_lanes
        real(wp) :: m(lanes, 3), q(scene_lanes, 4)
        real(wp) :: m_rest(lanes, 3), q_rest(lanes, 4)      !! rounding errors of m and q
        real(wp) :: tau(scene_lanes, 3)
        real(wp) :: sizes(lanes)                            !! of all torques so far
        real(wp) :: change(lanes, 7), error(lanes, 7)       !! weighted changes of (m, q)
    end type state_of_lanes

contains

    !> The form with the smaller parameter of the third kind at the momentum m, in principal axes.
    pure function chosen_form(core, m) result(form)
        type(body_core), intent(in) :: core
        real(wp), intent(in) :: m(3)
        type(form_of_step) :: form
        real(wp) :: x1, x2, x3

        x1 = m(core%order(1))**2
        x2 = m(core%order(2))**2
        x3 = m(core%order(3))**2
        if (core%gamma*(core%gamma*x2 + core%beta*x3) <= core%alpha*(core%beta*x1 + core%alpha*x2)) then
            form = form_of_step(core%order, core%parity, core%alpha, core%beta, core%gamma, core%a(1))
        else
            form = form_of_step(core%order(3:1:-1), -core%parity, -core%gamma, -core%beta, -core%alpha, &
                                core%a(3))
        end if
    end function chosen_form

    !> All lanes at the start of a step: x = (m, q) in the axes of the form and of the body, its rounding
    !> error, and the torque. One loop over all lanes, here and below, stores whole vectors: loading a vector
    !> after storing a single lane of it would wait.
    pure subroutine start_lanes(start, rest, torque, state)
        real(wp), intent(in) :: start(7), rest(7), torque(3)
        type(state_of_lanes), intent(out) :: state
        integer :: l

        do l = 1, lanes
            state%m(l, 1) = start(1)
            state%m(l, 2) = start(2)
            state%m(l, 3) = start(3)
            state%q(l, 1) = start(4)
            state%q(l, 2) = start(5)
            state%q(l, 3) = start(6)
            state%q(l, 4) = start(7)
            state%m_rest(l, 1) = rest(1)
            state%m_rest(l, 2) = rest(2)
            state%m_rest(l, 3) = rest(3)
            state%q_rest(l, 1) = rest(4)
            state%q_rest(l, 2) = rest(5)
            state%q_rest(l, 3) = rest(6)
            state%q_rest(l, 4) = rest(7)
            state%tau(l, 1) = torque(1)
            state%tau(l, 2) = torque(2)
            state%tau(l, 3) = torque(3)
            state%sizes(l) = 0.0_wp
        end do
        state%change = 0.0_wp
        state%error = 0.0_wp
    end subroutine start_lanes

    !> Ends sequences: adds the change by each sequence, with its last kick by h kick tau, times its weights,
    !> which are 0 in a lane that goes on. Lanes with begin = 1 return to the start.
    pure subroutine end_sequences(form, h, kick, weight, difference, begin, start, rest, torque, state)
        type(form_of_step), intent(in) :: form
        real(wp), intent(in) :: h, start(7), rest(7), torque(3)
        real(wp), intent(in), dimension(lanes) :: kick, weight, difference, begin
        type(state_of_lanes), intent(inout) :: state
        integer :: l, i1, i2, i3

        i1 = form%axis(1)
        i2 = form%axis(2)
        i3 = form%axis(3)
        do l = 1, lanes
            call end_number(begin(l), weight(l), difference(l), start(1), rest(1), &
                            h*kick(l)*state%tau(l, i1), state%m(l, 1), state%m_rest(l, 1), &
                            state%change(l, 1), state%error(l, 1))
            call end_number(begin(l), weight(l), difference(l), start(2), rest(2), &
                            h*kick(l)*state%tau(l, i2), state%m(l, 2), state%m_rest(l, 2), &
                            state%change(l, 2), state%error(l, 2))
            call end_number(begin(l), weight(l), difference(l), start(3), rest(3), &
                            form%sign3*(h*kick(l))*state%tau(l, i3), state%m(l, 3), state%m_rest(l, 3), &
                            state%change(l, 3), state%error(l, 3))
            call end_number(begin(l), weight(l), difference(l), start(4), rest(4), 0.0_wp, &
                            state%q(l, 1), state%q_rest(l, 1), state%change(l, 4), state%error(l, 4))
            call end_number(begin(l), weight(l), difference(l), start(5), rest(5), 0.0_wp, &
                            state%q(l, 2), state%q_rest(l, 2), state%change(l, 5), state%error(l, 5))
            call end_number(begin(l), weight(l), difference(l), start(6), rest(6), 0.0_wp, &
                            state%q(l, 3), state%q_rest(l, 3), state%change(l, 6), state%error(l, 6))
            call end_number(begin(l), weight(l), difference(l), start(7), rest(7), 0.0_wp, &
                            state%q(l, 4), state%q_rest(l, 4), state%change(l, 7), state%error(l, 7))
        end do
        do l = 1, lanes
            state%sizes(l) = state%sizes(l) &
                + (abs(state%tau(l, 1)) + abs(state%tau(l, 2)) + abs(state%tau(l, 3)))
            state%tau(l, 1) = begin(l)*torque(1) + (1 - begin(l))*state%tau(l, 1)
            state%tau(l, 2) = begin(l)*torque(2) + (1 - begin(l))*state%tau(l, 2)
            state%tau(l, 3) = begin(l)*torque(3) + (1 - begin(l))*state%tau(l, 3)
        end do
    end subroutine end_sequences

    !> Ends a sequence for one number of the state of one lane, after the last kick.
    pure subroutine end_number(begin, weight, difference, start, start_rest, last, x, rest, change, error)
        real(wp), intent(in) :: begin, weight, difference, start, start_rest, last
        real(wp), intent(inout) :: x, rest, change, error
        real(wp) :: changed

        changed = (x - start) + (rest + last)
        change = change + weight*changed
        error = error + difference*changed
        ! To a lane that goes on 0 is added, and what stands in a lane that begins is finite.
        x = begin*start + (1 - begin)*x
        rest = begin*start_rest + (1 - begin)*rest
    end subroutine end_number

    !> Kick and drift, see kick_and_drift.inc, exact to rounding up to short_limit.
    pure subroutine kick_and_drift(form, h, half, kick, state)

        include 'kick_and_drift.inc'

    contains

        pure subroutine series(e1, e2, y, scd)
            real(wp), intent(in) :: e1, e2
            real(wp), intent(out) :: y, scd

            call short_series(e1, e2, y, scd)
        end subroutine series

        pure function third_kind(e1, e2, nu) result(third)
            real(wp), intent(in) :: e1, e2, nu
            real(wp) :: third

            third = short_third_kind(e1, e2, nu)
        end function third_kind

    end subroutine kick_and_drift

    !> Kick and drift, see kick_and_drift.inc, by the first terms of the series, which saves 8 % of a step.
    pure subroutine kick_and_drift_few(form, h, half, kick, state)

        include 'kick_and_drift.inc'

    contains

        pure subroutine series(e1, e2, y, scd)
            real(wp), intent(in) :: e1, e2
            real(wp), intent(out) :: y, scd

            call tiny_series(e1, e2, y, scd)
        end subroutine series

        pure function third_kind(e1, e2, nu) result(third)
            real(wp), intent(in) :: e1, e2, nu
            real(wp) :: third

            third = tiny_third_kind(e1, e2, nu)
        end function third_kind

    end subroutine kick_and_drift_few

    !> x + change; rest receives the rounding error of the sum (Kahan).
    pure subroutine add(x, rest, change)
        real(wp), intent(inout) :: x, rest
        real(wp), intent(in) :: change
        real(wp) :: total, part

        part = change + rest
        total = x + part
        rest = part - (total - x)
        x = total
    end subroutine add

    include '../flow/orbit_formulas.inc'

    include '../flow/series_formulas.inc'

    include '../flow/short_coefficients.inc'

    include '../flow/short_third_kind.inc'

    include '../flow/tiny_formulas.inc'

    include '../flow/tiny_third_kind.inc'

    include '../flow/short_formulas.inc'

    include '../flow/join_formulas.inc'

end module frb_extrapolation_lanes
