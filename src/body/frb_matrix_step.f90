!> Algorithm 1, kept for the users of the paper's package; new code: `free_flow`.
!>
!> The free rigid body with the attitude as a rotation matrix.
module frb_matrix_step
    use frb_kinds, only: wp
    use frb_paper_angle, only: exact_angle, quadrature_angle, angle_by_middle_axis
    use frb_paper_momentum, only: momentum_step, momentum_by_addition, momentum_by_phase
    use frb_paper_motion, only: paper_motion, normal_form, attitude_code, simple_motion, add_momentum, &
        motion_elliptic
    use frb_rotations, only: cross, norm3, quat_rotate, quat_along
    use frb_status, only: return_or_stop, status_ok
    implicit none
    private

    public :: frb_step

contains

    !> One step of the free rigid body, m' = m x (m/I), Q' = Q hat(m/I): Algorithm 1 of the paper, with the
    !> frame from m and m' (section 1.3) and the angle (9).
    !>
    !> The momentum may have any norm, the moments any order, h any sign and size: rescaling and reordering
    !> (section 3.1) happen inside. Qin need not be orthogonal to rounding: Qout is Qin times a rotation,
    !> formed as Qin plus a change.
    !> Output may be the same variable as input. Motions on the separatrix, about an axis, with two or three
    !> equal moments and without momentum have formulas of their own.
    !>
    !> np absent or 0: exact. np >= 1: semi-exact, the integral of the third kind by np Gauss-Legendre points
    !> (order 2 np in h, time-symmetric; |m|, the energy and Q m are kept too); for a small h only, and not
    !> faster than the exact step.
    !>
    !> Accuracy of the exact step, in units of the inherent sensitivity (data/reference): median below 1 and
    !> maximum below 3 in every group, for m and Q; Q orthogonal to 1e-14 (checked by steps). In a chain of
    !> 20 000 steps |m|, the energy and Q^T Q stay to 1e-13, Q m to 3e-13 (checked by step-laws); rounding
    !> adds up like a random walk.
    !> The sensitivity itself grows near the middle axis and the separatrix: once h covers a half turn, m and
    !> Q lose about log10(1/(1 - k**2)) of 16 digits, all of them for 1 - k**2 below 1e-16, where m stays
    !> on the orbit, Q orthogonal and Q m constant. With np >= 1 Q also loses digits, and needs a smaller h,
    !> where m' is small: the frame turns fast there.
    !>
    !> Errors: status_bad_moments (not positive and finite), status_bad_momentum, status_bad_time,
    !> status_bad_attitude (not finite, or beyond 1e300), status_bad_count (np < 0 or np > 1000),
    !> status_lapack_failed (no nodes for np > 10). The output is then the input.
    subroutine frb_step(Piout, Qout, h, aInert, Piin, Qin, np, stat)
        ! Output and input may be one variable. `target` says so to the compiler, `inout` keeps the value that
        ! stands there on entry, and all input is read before output is written.
        real(wp), intent(inout), target :: Piout(3)    !! body angular momentum at h
        real(wp), intent(inout), target :: Qout(3, 3)  !! attitude at h, body to space
        real(wp), intent(in) :: h                      !! step, any finite number
        real(wp), intent(in), target :: aInert(3)      !! principal moments of inertia, any order
        real(wp), intent(in), target :: Piin(3)        !! body angular momentum at 0
        real(wp), intent(in), target :: Qin(3, 3)      !! attitude at 0, body to space
        integer, intent(in), optional :: np            !! Gauss points; 0 or absent: exact
        integer, intent(out), optional :: stat         !! status_ok, or what is wrong
        type(paper_motion) :: motion
        real(wp) :: start_m(3), start_q(3, 3), change(3), turn(4)
        integer :: code, points

        start_m = Piin
        start_q = Qin
        points = 0
        if (present(np)) points = np
        call normal_form(h, aInert, start_m, motion, code)
        if (code == status_ok) code = attitude_code(9, start_q, .true., points)
        if (code == status_ok) call change_and_turn(motion, points, change, turn, code)
        if (code == status_ok) then
            Piout = add_momentum(motion, start_m, change)
            Qout = turned_attitude(motion, start_q, turn)
        else
            Piout = start_m
            Qout = start_q
        end if
        call return_or_stop(code, 'frb_step', stat)
    end subroutine frb_step

    !> Qin E(q/|q|) as Qin + Qin (E(q/|q|) - 1), with E - 1 = 2 (q0 hat(q) + hat(q)**2)/|q|**2, (10): E is a
    !> rotation for any norm of q. A small step has a small change with small rounding errors, so in a chain
    !> of steps the lengths of the columns and the angles between them are kept.
    pure function turned_attitude(motion, q_in, turn) result(q_out)
        type(paper_motion), intent(in) :: motion
        real(wp), intent(in) :: q_in(3, 3)
        real(wp), intent(in) :: turn(4)         !! a quaternion of a norm between 1/2 and 8, sorted axes
        real(wp) :: q_out(3, 3)
        real(wp) :: q0, v(3), factor

        q0 = turn(1)
        if (motion%sorted) then
            v = turn(2:4)
        else
            v(motion%order) = motion%parity*turn(2:4)
        end if
        ! Multiply by the factor last: factor*q0 may be next to 1/2, where rounding errors have one sign.
        factor = 2/(q0*q0 + v(1)*v(1) + v(2)*v(2) + v(3)*v(3))
        associate (a1 => q_in(:, 1), a2 => q_in(:, 2), a3 => q_in(:, 3))
            q_out(:, 1) = a1 + factor*(a2*(v(1)*v(2) + q0*v(3)) + a3*(v(1)*v(3) - q0*v(2)) &
                                       - a1*(v(2)*v(2) + v(3)*v(3)))
            q_out(:, 2) = a2 + factor*(a1*(v(1)*v(2) - q0*v(3)) + a3*(v(2)*v(3) + q0*v(1)) &
                                       - a2*(v(1)*v(1) + v(3)*v(3)))
            q_out(:, 3) = a3 + factor*(a1*(v(1)*v(3) + q0*v(2)) + a2*(v(2)*v(3) - q0*v(1)) &
                                       - a3*(v(1)*v(1) + v(2)*v(2)))
        end associate
    end function turned_attitude

    !> The change of the momentum and the turn of the body. Lines (5) to (18) of Algorithm 1: the rotation
    !> P(0)^T Y(psi) P(h), P = [v, w, m]^T with v along m', (6), in sorted axes. The result is a quaternion:
    !> nine rounded numbers are nearly a rotation, a quaternion always is one.
    subroutine change_and_turn(motion, points, change, turn, code)
        type(paper_motion), intent(in) :: motion
        integer, intent(in) :: points
        real(wp), intent(out) :: change(3)
        real(wp), intent(out) :: turn(4)
        integer, intent(out) :: code
        type(momentum_step) :: step
        real(wp) :: v0(3), w0(3), v(3), w(3), cosine, sine, rotation(3, 3)
        integer :: j

        code = status_ok
        if (motion%kind /= motion_elliptic) then
            call simple_motion(motion, change, turn)
            return
        end if
        v0 = direction_of_derivative(motion, motion%m)
        w0 = cross(motion%m, v0)
        if (points > 0 .and. motion%kc2 > 0.0_wp) then
            call momentum_by_phase(motion, step)
            v = direction_of_derivative(motion, step%m)
            call quadrature_turn(motion, step, points, cosine, sine, code)
        else
            call momentum_by_addition(motion, step)
            v = direction_of_derivative(motion, step%m)
            call exact_turn(motion, step, v0, w0, v, cosine, sine)
        end if
        w = cross(step%m, v)
        change = step%change

        do j = 1, 3
            rotation(:, j) = v0*(cosine*v(j) - sine*w(j)) + w0*(sine*v(j) + cosine*w(j)) + motion%m*step%m(j)
        end do
        turn = quat_along(rotation)
    end subroutine change_and_turn

    !> Unit vector along m'. If rounding has put m(h) on an axis, m' is zero, and any vector across m will do.
    pure function direction_of_derivative(motion, m) result(v)
        type(paper_motion), intent(in) :: motion
        real(wp), intent(in) :: m(3)
        real(wp) :: v(3)
        real(wp) :: length

        v(1) = -motion%alpha*m(2)*m(3)
        v(2) = motion%beta*m(3)*m(1)
        v(3) = -motion%gamma*m(1)*m(2)
        length = norm3(v)
        if (length < tiny(1.0_wp)) then
            v = cross(m, merge([1.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, 1.0_wp], abs(m(1)) < 0.7_wp))
            length = norm3(v)
        end if
        v = v/length
    end function direction_of_derivative

    !> Cosine and sine of psi, exactly. P(0) z P(h)^T is a rotation about e3; psi is its angle plus `angle`.
    pure subroutine exact_turn(motion, step, v0, w0, v, cosine, sine)
        type(paper_motion), intent(in) :: motion
        type(momentum_step), intent(in) :: step
        real(wp), intent(in) :: v0(3), w0(3), v(3)
        real(wp), intent(out) :: cosine, sine
        real(wp) :: angle, z(4), turned(3), x, y, length2, cosine_angle, sine_angle

        call exact_angle(motion, step, angle_by_middle_axis, angle, z)
        turned = quat_rotate(z/sqrt(z(1)*z(1) + z(2)*z(2) + z(4)*z(4)), v)
        x = v0(1)*turned(1) + v0(2)*turned(2) + v0(3)*turned(3)
        y = w0(1)*turned(1) + w0(2)*turned(2) + w0(3)*turned(3)
        length2 = x*x + y*y
        if (abs(1 - length2) > 1.0e-8_wp) then    ! after a long stay near the middle axis
            if (length2 < 1.0e-280_wp) then
                x = 1.0_wp
                y = 0.0_wp
                length2 = 1.0_wp
            end if
            x = x/sqrt(length2)
            y = y/sqrt(length2)
        else
            ! 1/sqrt(length2) by the first two terms of its series about 1.
            x = x + (0.5_wp*(1 - length2))*x
            y = y + (0.5_wp*(1 - length2))*y
        end if
        cosine_angle = cos(angle)
        sine_angle = sin(angle)
        cosine = x*cosine_angle - y*sine_angle
        sine = y*cosine_angle + x*sine_angle
    end subroutine exact_turn

    !> Cosine and sine of psi by quadrature.
    subroutine quadrature_turn(motion, step, points, cosine, sine, code)
        type(paper_motion), intent(in) :: motion
        type(momentum_step), intent(in) :: step
        integer, intent(in) :: points
        real(wp), intent(out) :: cosine, sine
        integer, intent(out) :: code
        real(wp) :: psi

        psi = quadrature_angle(motion, step, angle_by_middle_axis, points, code)
        cosine = cos(psi)
        sine = sin(psi)
    end subroutine quadrature_turn

end module frb_matrix_step
