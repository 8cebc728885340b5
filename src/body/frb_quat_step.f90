!> Algorithm 2, kept for the users of the paper's package; new code: `free_flow`.
!>
!> The free rigid body with the attitude as a quaternion, in the three frames of section 1.4.
module frb_quat_step
    use frb_kinds, only: wp
    use frb_paper_angle, only: exact_angle, quadrature_angle, angle_by_middle_axis, angle_by_outer_axes
    use frb_paper_momentum, only: momentum_step, momentum_by_addition, momentum_by_phase
    use frb_paper_motion, only: paper_motion, normal_form, attitude_code, simple_motion, add_momentum, &
        turn_from_one, motion_elliptic
    use frb_rotations, only: quat_product, quat_conjugate
    use frb_status, only: return_or_stop, status_ok, status_bad_option
    implicit none
    private

    public :: quat_step

    integer, parameter :: frame_shortest = 1    !! p takes m to e3 by the shortest rotation
    integer, parameter :: frame_derivative = 2  !! first row of P along m', as in Algorithm 1
    integer, parameter :: frame_axis = 3        !! first row of P along m x e3

contains

    !> One step of the free rigid body, m' = m x (m/I), q' = q (0, m/I)/2: Algorithm 2 of the paper, with the
    !> frame (1), (2) or (3) of section 1.4.
    !>
    !> The momentum may have any norm, the moments any order, h any sign and size: rescaling and reordering
    !> (section 3.1) happen inside. qin may have any nonzero norm: qout is qin times a unit quaternion.
    !> Output may be the same variable as input. Motions on the separatrix, about an axis, with two or three
    !> equal moments and without momentum have formulas of their own.
    !>
    !> np absent or 0: exact, and qout depends continuously on h. np >= 1: semi-exact, the integral of the
    !> third kind by np Gauss-Legendre points (order 2 np in h, time-symmetric; |m|, the energy and the
    !> momentum in space are kept too); for a small h only, and not faster than the exact step. The turn
    !> from qin to qout then has a scalar part >= 0.
    !>
    !> Accuracy of the exact step, in units of the inherent sensitivity (data/reference): in every group a
    !> median below 1.5 and a maximum below 3, for q in each frame, and below 1 and 3 for m; the turn from qin
    !> to qout is unit to 1e-14 (checked by steps). In a chain of 20 000 steps |m|, the energy and |q| stay to
    !> 1e-13, q m q* to 3e-13 (checked by step-laws); rounding adds up like a random walk.
    !> The sensitivity itself grows near the middle axis and the separatrix: once h covers a half turn, m and
    !> q lose about log10(1/(1 - k**2)) of 16 digits. The frames have poles, where p turns fast: m along -e3
    !> for (1), along any principal axis for (2), along +-e3 for (3). Exact steps lose nothing there;
    !> semi-exact ones about log10(1/distance) digits, and their order shows for smaller h only.
    !>
    !> Errors: status_bad_moments (not positive and finite), status_bad_momentum, status_bad_time,
    !> status_bad_attitude (not finite, zero, or beyond 1e300), status_bad_count (np < 0 or np > 1000),
    !> status_bad_option (another frame), status_lapack_failed (no nodes for np > 10). The output is then the
    !> input.
    subroutine quat_step(Piout, qout, h, aInert, Piin, qin, np, frame, stat)
        ! Output and input may be one variable. `target` says so to the compiler, `inout` keeps the value that
        ! stands there on entry, and all input is read before output is written.
        real(wp), intent(inout), target :: Piout(3)    !! body angular momentum at h
        real(wp), intent(inout), target :: qout(4)     !! attitude at h, scalar first, body to space
        real(wp), intent(in) :: h                      !! step, any finite number
        real(wp), intent(in), target :: aInert(3)      !! principal moments of inertia, any order
        real(wp), intent(in), target :: Piin(3)        !! body angular momentum at 0
        real(wp), intent(in), target :: qin(4)         !! attitude at 0, scalar first, body to space
        integer, intent(in), optional :: np            !! Gauss points; 0 or absent: exact
        integer, intent(in), optional :: frame         !! 1 (default), 2 or 3
        integer, intent(out), optional :: stat         !! status_ok, or what is wrong
        type(paper_motion) :: motion
        real(wp) :: start_m(3), start_q(4), change(3), turn(4), turn_change(4), sense
        integer :: code, points, chosen

        start_m = Piin
        start_q = qin
        points = 0
        if (present(np)) points = np
        chosen = frame_shortest
        if (present(frame)) chosen = frame
        call normal_form(h, aInert, start_m, motion, code)
        if (code == status_ok) code = attitude_code(4, start_q, .false., points)
        if (code == status_ok .and. (chosen < frame_shortest .or. chosen > frame_axis)) then
            code = status_bad_option
        end if
        if (code == status_ok) call change_and_turn(motion, points, chosen, change, turn, code)
        if (code == status_ok) then
            Piout = add_momentum(motion, start_m, change)
            call turn_from_one(motion, turn, turn_change, sense)
            qout = sense*(start_q + quat_product(start_q, turn_change))
        else
            Piout = start_m
            qout = start_q
        end if
        call return_or_stop(code, 'quat_step', stat)
    end subroutine quat_step

    !> The change of the momentum and the turn of the body. Lines (5) to (21) of Algorithm 2: p(0)^-1 y(psi)
    !> p(h), (12), in sorted axes.
    subroutine change_and_turn(motion, points, frame, change, turn, code)
        type(paper_motion), intent(in) :: motion
        integer, intent(in) :: points, frame
        real(wp), intent(out) :: change(3)
        real(wp), intent(out) :: turn(4)
        integer, intent(out) :: code
        type(momentum_step) :: step
        real(wp) :: p0(4), p(4), y(2)

        code = status_ok
        if (motion%kind /= motion_elliptic) then
            call simple_motion(motion, change, turn)
            return
        end if
        p0 = frame_quaternion(motion, motion%m, frame)
        if (points > 0 .and. motion%kc2 > 0.0_wp) then
            call momentum_by_phase(motion, step)
            p = frame_quaternion(motion, step%m, frame)
            call quadrature_turn(motion, step, points, frame, y, code)
        else
            call momentum_by_addition(motion, step)
            p = frame_quaternion(motion, step%m, frame)
            call exact_turn(motion, step, frame, p0, p, y)
        end if
        change = step%change
        turn = quat_product(quat_conjugate(p0), quat_product([y(1), 0.0_wp, 0.0_wp, y(2)], p))
        if (points > 0 .and. turn(1) < 0.0_wp) turn = -turn
    end subroutine change_and_turn

    !> The quaternion p of a frame: p m p^-1 = e3, (15), with
    !> (p0, p3) = (cos(xi/2), sin(xi/2)) sqrt((1 + m3)/2): it is frame (1), turned about e3 by an angle xi.
    !> The paper prints p3**2, which has (1 - cos(xi))/2, and the sign of p0 p3, which is that of sin(xi).
    !> Here cos(xi) and sin(xi) themselves are formed, and no digit is lost.
    pure function frame_quaternion(motion, m, frame) result(p)
        type(paper_motion), intent(in) :: motion
        real(wp), intent(in) :: m(3)
        integer, intent(in) :: frame
        real(wp) :: p(4)
        real(wp) :: one_plus_m3, root, d1, d2, d3, half(2)

        if (m(3) < 0.0_wp) then
            one_plus_m3 = (m(1)*m(1) + m(2)*m(2))/(1 - m(3))
        else
            one_plus_m3 = 1 + m(3)
        end if
        if (one_plus_m3 < tiny(1.0_wp)) then
            p = [0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp]    ! m = -e3 to rounding: half a turn about e1
            return
        end if
        root = sqrt(0.5_wp*one_plus_m3)
        if (frame == frame_shortest) then
            p = [root, 0.5_wp*m(2)/root, -0.5_wp*m(1)/root, 0.0_wp]
        else
            if (frame == frame_axis) then
                half = half_angle(m(2), m(1))
            else
                d1 = -motion%alpha*m(2)*m(3)
                d2 = motion%beta*m(3)*m(1)
                d3 = -motion%gamma*m(1)*m(2)/one_plus_m3
                half = half_angle(d1 - m(1)*d3, m(2)*d3 - d2)
            end if
            p(1) = half(1)*root
            p(4) = half(2)*root
            p(2) = (p(4)*m(1) + p(1)*m(2))/one_plus_m3
            p(3) = (p(4)*m(2) - p(1)*m(1))/one_plus_m3
        end if
    end function frame_quaternion

    !> (cos(xi/2), sin(xi/2)) of the angle xi in [-pi, pi] of the vector (x, y), 0 for no vector.
    pure function half_angle(x, y) result(half)
        real(wp), intent(in) :: x, y
        real(wp) :: half(2)
        real(wp) :: cosine, sine, length

        length = hypot(x, y)
        if (length < tiny(1.0_wp)) then
            half = [1.0_wp, 0.0_wp]
            return
        end if
        cosine = x/length
        sine = y/length
        if (cosine >= 0.0_wp) then
            half(1) = sqrt(0.5_wp*(1 + cosine))
            half(2) = 0.5_wp*sine/half(1)
        else
            half(2) = sign(sqrt(0.5_wp*(1 - cosine)), sine)
            half(1) = 0.5_wp*sine/half(2)
        end if
    end function half_angle

    !> (cos(psi/2), sin(psi/2)), exactly. p(0) z p(h)^-1 is a rotation about e3; psi is its angle plus
    !> `angle`.
    pure subroutine exact_turn(motion, step, frame, p0, p, y)
        type(paper_motion), intent(in) :: motion
        type(momentum_step), intent(in) :: step
        integer, intent(in) :: frame
        real(wp), intent(in) :: p0(4), p(4)
        real(wp), intent(out) :: y(2)
        real(wp) :: angle, z(4), product(4), scaling, cosine, sine

        if (frame == frame_derivative) then
            call exact_angle(motion, step, angle_by_middle_axis, angle, z)
        else
            call exact_angle(motion, step, angle_by_outer_axes, angle, z)
        end if
        product = quat_product(quat_product(p0, z), quat_conjugate(p))
        scaling = product(1)*product(1) + product(4)*product(4)
        if (scaling < 1.0e-280_wp) then    ! after a long stay near the middle axis
            product = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            scaling = 1.0_wp
        end if
        scaling = 1/sqrt(scaling)
        cosine = cos(0.5_wp*angle)*scaling
        sine = sin(0.5_wp*angle)*scaling
        y(1) = product(1)*cosine - product(4)*sine
        y(2) = product(4)*cosine + product(1)*sine
    end subroutine exact_turn

    !> (cos(psi/2), sin(psi/2)) by quadrature. In frame (1) psi of (16) has one more term, f: the change of
    !> the angle of the vector (m2, m1).
    subroutine quadrature_turn(motion, step, points, frame, y, code)
        type(paper_motion), intent(in) :: motion
        type(momentum_step), intent(in) :: step
        integer, intent(in) :: points, frame
        real(wp), intent(out) :: y(2)
        integer, intent(out) :: code
        real(wp) :: psi, from(2), to(2), part(2)

        if (frame == frame_derivative) then
            psi = quadrature_angle(motion, step, angle_by_middle_axis, points, code)
        else
            psi = quadrature_angle(motion, step, angle_by_outer_axes, points, code)
        end if
        y = [cos(0.5_wp*psi), sin(0.5_wp*psi)]
        if (frame == frame_shortest) then
            from = half_angle(motion%m(2), motion%m(1))
            to = half_angle(step%m(2), step%m(1))
            part = [from(1)*to(1) + from(2)*to(2), from(1)*to(2) - from(2)*to(1)]
            y = [y(1)*part(1) - y(2)*part(2), y(2)*part(1) + y(1)*part(2)]
        end if
    end subroutine quadrature_turn

end module frb_quat_step
