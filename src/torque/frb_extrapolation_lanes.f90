!> Kick and drift of a few lanes at a time, each with a step of its own: the formulas of the free flow for
!> short steps, compensated, which costs 2 % here, in a loop that the compiler turns into one vector.
!>
!> The series are those of frb_flow_one, and end at degree 6 in the squares of the frequencies times t: beyond
!> short_limit a drift is no longer exact, but an approximation of order 12.
module frb_extrapolation_lanes
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    implicit none
    private

    public :: lanes, state_of_lanes, form_of_step, chosen_form, begin_sequences, kick_and_drift

    !> One of the two forms of the turn: axes of the body in the order of the formulas, the third one turned
    !> round if need be so that they are right-handed, and the constants of the body for them. The mirror form
    !> is the first one with descending moments: alpha, beta, gamma are then negative.
    type :: form_of_step
        integer :: axis(3) = [1, 2, 3]
        real(wp) :: sign3 = 1.0_wp
        real(wp) :: alpha = 0.0_wp, beta = 0.0_wp, gamma = 0.0_wp, a1 = 0.0_wp
    end type form_of_step

    integer, parameter :: lanes = 4     !! sequences advanced at a time

    !> The lanes of a step that is tried; in the axes of the body but for m, which is in those of the form.
    type :: state_of_lanes
        real(wp) :: m(lanes, 3) = 0.0_wp
        real(wp) :: q(lanes, 4) = 0.0_wp
        real(wp) :: m_rest(lanes, 3) = 0.0_wp, q_rest(lanes, 4) = 0.0_wp
        real(wp) :: tau(lanes, 3) = 0.0_wp
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

    !> Lanes with begin = 1 at the start of the step, those with 0 as they are: by whole vectors, as a vector
    !> of which one lane was stored by itself has to wait to be loaded.
    pure subroutine begin_sequences(begin, start, rest, torque, now)
        real(wp), intent(in) :: begin(lanes), start(7), rest(7), torque(3)
        type(state_of_lanes), intent(inout) :: now
        real(wp) :: keep
        integer :: l

        do l = 1, lanes
            ! Of a lane that goes on 0 is added, and what stands in a lane that begins is finite.
            keep = 1 - begin(l)
            now%m(l, 1) = begin(l)*start(1) + keep*now%m(l, 1)
            now%m(l, 2) = begin(l)*start(2) + keep*now%m(l, 2)
            now%m(l, 3) = begin(l)*start(3) + keep*now%m(l, 3)
            now%q(l, 1) = begin(l)*start(4) + keep*now%q(l, 1)
            now%q(l, 2) = begin(l)*start(5) + keep*now%q(l, 2)
            now%q(l, 3) = begin(l)*start(6) + keep*now%q(l, 3)
            now%q(l, 4) = begin(l)*start(7) + keep*now%q(l, 4)
            now%m_rest(l, 1) = begin(l)*rest(1) + keep*now%m_rest(l, 1)
            now%m_rest(l, 2) = begin(l)*rest(2) + keep*now%m_rest(l, 2)
            now%m_rest(l, 3) = begin(l)*rest(3) + keep*now%m_rest(l, 3)
            now%q_rest(l, 1) = begin(l)*rest(4) + keep*now%q_rest(l, 1)
            now%q_rest(l, 2) = begin(l)*rest(5) + keep*now%q_rest(l, 2)
            now%q_rest(l, 3) = begin(l)*rest(6) + keep*now%q_rest(l, 3)
            now%q_rest(l, 4) = begin(l)*rest(7) + keep*now%q_rest(l, 4)
            now%tau(l, 1) = begin(l)*torque(1) + keep*now%tau(l, 1)
            now%tau(l, 2) = begin(l)*torque(2) + keep*now%tau(l, 2)
            now%tau(l, 3) = begin(l)*torque(3) + keep*now%tau(l, 3)
        end do
    end subroutine begin_sequences

    !> m + h kick tau, then the free motion of m and q over 2 h half, lane by lane. m is in the axes of the
    !> form; q and tau are in the body's, their columns handed over in the order of the form.
    pure subroutine kick_and_drift(form, h, half, kick, tau1, tau2, tau3, m, q0, q1, q2, q3, m_rest, &
                                   rest0, rest1, rest2, rest3, sizes)
        type(form_of_step), intent(in) :: form
        real(wp), intent(in) :: h, half(lanes), kick(lanes)
        real(wp), intent(in), dimension(lanes) :: tau1, tau2, tau3
        real(wp), intent(inout) :: m(lanes, 3)
        real(wp), intent(inout), dimension(lanes) :: q0, q1, q2, q3
        real(wp), intent(inout) :: m_rest(lanes, 3)                         !! what m lacks
        real(wp), intent(inout), dimension(lanes) :: rest0, rest1, rest2, rest3     !! and q
        real(wp), intent(inout) :: sizes(lanes)                             !! of all torques so far
        real(wp) :: t, a, b, g, gg, p, r, nu, nu_mirror, y, scd, w, k, a23, b31, g12, m1, m2, m3
        real(wp) :: v0, v2, v3, angle, cosm1, along, dot, change, w0, w1, w2, w3, last, d1, d2, d3
        integer :: l

        do l = 1, lanes
            sizes(l) = sizes(l) + (abs(tau1(l)) + abs(tau2(l)) + abs(tau3(l)))
            call add(m(l, 1), m_rest(l, 1), h*kick(l)*tau1(l))
            call add(m(l, 2), m_rest(l, 2), h*kick(l)*tau2(l))
            call add(m(l, 3), m_rest(l, 3), form%sign3*(h*kick(l)*tau3(l)))
            m1 = m(l, 1)
            m2 = m(l, 2)
            m3 = m(l, 3)
            t = h*half(l)
            ! The longest chain first, from m to the angle of the turn; the new m last, which waits for the
            ! next torque anyway.
            call orbit_constants(form%alpha, form%beta, form%gamma, t, m1, m2, m3, a, b, g, gg, p, r, nu, &
                                 nu_mirror)
            angle = form%a1*t - b*(nu*short_third_kind(p + r, p*r, nu))
            call small_turn(angle*angle*gg, along, cosm1)
            along = angle*along
            call short_series(p + r, p*r, y, scd)
            a23 = a*(m2*m3)
            b31 = b*(m3*m1)
            g12 = g*(m1*m2)
            w = r*y
            k = a*g*(m2*m2)
            call short_direction(b, g, w, k*y, y, scd, m2, m3, b31, g12, v0, v2, v3)
            change = short_norm(v0*(2 + v0) + (v2*v2 + v3*v3))
            call join_turns(1 + cosm1, along, m1, m2, m3, 1 + v0, v2, v3, w1, w2, w3)
            dot = along*(m2*v2 + m3*v3)
            ! The turn without its norm, then what the norm changes.
            w0 = (cosm1 + v0) + (cosm1*v0 - dot)
            last = form%sign3*q3(l)
            d1 = q0(l)*w0 - (q1(l)*w1 + q2(l)*w2 + last*w3)
            d2 = q1(l)*w0 + (q0(l)*w1 + (q2(l)*w3 - last*w2))
            d3 = q2(l)*w0 + (q0(l)*w2 + (last*w1 - q1(l)*w3))
            w0 = last*w0 + (q0(l)*w3 + (q1(l)*w2 - q2(l)*w1))
            call add(q0(l), rest0(l), d1 + change*(q0(l) + d1))
            call add(q1(l), rest1(l), d2 + change*(q1(l) + d2))
            call add(q2(l), rest2(l), d3 + change*(q2(l) + d3))
            call add(q3(l), rest3(l), form%sign3*(w0 + change*(last + w0)))
            call short_momentum(p*y, w, k*(scd*scd), scd, m1, m2, m3, a23, b31, g12, d1, d2, d3)
            call add(m(l, 1), m_rest(l, 1), d1)
            call add(m(l, 2), m_rest(l, 2), d2)
            call add(m(l, 3), m_rest(l, 3), d3)
        end do
    end subroutine kick_and_drift

    !> x + change, and in rest what x then lacks (Kahan).
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

    include '../flow/short_formulas.inc'

    include '../flow/join_formulas.inc'

end module frb_extrapolation_lanes
