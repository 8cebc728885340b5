!> free_flow in its limits, each against its own closed form: sphere, symmetric tops, rotation about an axis,
!> the separatrix; next to the separatrix against Taylor series.
module frb_test_flow_limits
    use frb_checks, only: tally, worst_of
    use frb_flow_samples, only: stream, true_case, advanced, made_finite, near_separatrix, defect, no_turn, &
        no_rotation
    use frb_free_flow, only: free_flow, flow_tangent, rigid_body
    use frb_kinds, only: wp, qp, has_quad
    use frb_reference_cases, only: reference_case, score_momentum, score_attitude
    use frb_rotations, only: norm3
    implicit none
    private

    public :: test_flow_limits

    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Closed forms: error of m relative to |m| and of q, in units of eps (1 + angles turned in the step).
    real(wp), parameter :: closed_form = 2*eps
    !> Largest score on the separatrix and next to it.
    real(wp), parameter :: separatrix_score = 2.0_wp

contains

    subroutine test_flow_limits(t)
        type(tally), intent(inout) :: t

        call t%open_suite('flow-limits', 32)
        call check_sphere(t)
        call check_symmetric_tops(t)
        call check_axes(t)
        call check_tiny_deviations(t)
        call check_separatrix_derivatives(t)
        if (t%provided(has_quad, 3, 'on the separatrix, which needs 30 digits')) call check_separatrix(t)
        if (t%provided(has_quad, 4, 'next to the separatrix, which needs 30 digits')) call check_both_sides(t)
        call t%close_suite()
    end subroutine test_flow_limits

    !> Rotation by an angle about a vector that is not zero, in quadruple precision.
    pure function turn_about(axis, angle) result(q)
        real(qp), intent(in) :: axis(3), angle
        real(qp) :: q(4)

        q = [cos(angle/2), sin(angle/2)*axis/norm2(axis)]
    end function turn_about

    pure function product4(p, q) result(pq)
        real(qp), intent(in) :: p(4), q(4)
        real(qp) :: pq(4)

        pq = [p(1)*q(1) - p(2)*q(2) - p(3)*q(3) - p(4)*q(4), p(1)*q(2) + p(2)*q(1) + p(3)*q(4) - p(4)*q(3), &
              p(1)*q(3) + p(3)*q(1) + p(4)*q(2) - p(2)*q(4), p(1)*q(4) + p(4)*q(1) + p(2)*q(3) - p(3)*q(2)]
    end function product4

    !> I1 = I2 = I3: m stays, the body turns about it by |m| h/I.
    subroutine check_sphere(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        real(wp) :: m0(3), moment, h, state(7), worst, moved
        real(qp) :: angle
        integer :: i

        worst = 0.0_wp
        moved = 0.0_wp
        do i = 1, 300
            m0 = random%log_uniform(-3.0_wp, 3.0_wp)*random%direction()
            moment = random%log_uniform(-3.0_wp, 3.0_wp)
            h = moment/norm3(m0)*sign(random%log_uniform(-9.0_wp, 5.0_wp), random%uniform(-1.0_wp, 1.0_wp))
            state = advanced([moment, moment, moment], m0, h)
            angle = norm2(real(m0, qp))*h/moment
            moved = worst_of(moved, [abs(state(1:3) - m0)])
            worst = worst_of(worst, real(norm2(state(4:7) - turn_about(real(m0, qp), angle)) &
                                         /(1 + abs(angle)), wp))
        end do
        call t%at_most('sphere-keeps-its-momentum', moved, 0.0_wp)
        call t%at_most('sphere-turns-about-its-momentum', worst, closed_form)
    end subroutine check_sphere

    !> Moments A, A, C with the symmetry axis j: in the body m turns about axis j by -(1/C - 1/A) m_j h;
    !> the attitude is the turn about m by |m| h/A, then the one about axis j by (1/C - 1/A) m_j h.
    subroutine check_symmetric_tops(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: names(2) = ['oblate ', 'prolate']
        type(stream) :: random
        real(wp) :: moments(3), m0(3), h, state(7), worst(2), kept
        real(qp) :: a, c, phi, m(3), q(4), axis(3), size
        integer :: i, j, shape

        do shape = 1, 2
            worst = 0.0_wp
            kept = 0.0_wp
            do i = 1, 600
                j = 1 + mod(i, 3)
                moments = random%log_uniform(-2.0_wp, 2.0_wp)
                moments(j) = moments(j)*merge(random%uniform(1.0_wp, 2.0_wp), &
                                              random%log_uniform(-3.0_wp, 0.0_wp), shape == 1)
                m0 = random%direction()
                if (mod(i, 7) == 0) m0(j) = m0(j)*random%log_uniform(-16.0_wp, -1.0_wp)
                h = minval(moments)*sign(random%log_uniform(-8.0_wp, 4.0_wp), random%uniform(-1.0_wp, 1.0_wp))
                state = advanced(moments, m0, h)
                a = moments(1 + mod(j, 3))
                c = moments(j)
                phi = (1/c - 1/a)*m0(j)*h
                axis = 0.0_qp
                axis(j) = 1.0_qp
                m = cos(phi)*m0 - sin(phi)*[axis(2)*m0(3) - axis(3)*m0(2), axis(3)*m0(1) - axis(1)*m0(3), &
                                            axis(1)*m0(2) - axis(2)*m0(1)] + (1 - cos(phi))*m0(j)*axis
                q = product4(turn_about(real(m0, qp), norm2(real(m0, qp))*h/a), turn_about(axis, phi))
                size = 1 + abs(h)*norm3(m0)*maxval(1/moments)
                worst(1) = worst_of(worst(1), real(norm2(state(1:3) - m)/norm2(m)/size, wp))
                worst(2) = worst_of(worst(2), real(norm2(state(4:7) - q)/size, wp))
                kept = worst_of(kept, abs(state(j) - m0(j)))
            end do
            call t%at_most(trim(names(shape))//'-top-momentum-is-trigonometric', worst(1), closed_form)
            call t%at_most(trim(names(shape))//'-top-attitude-is-trigonometric', worst(2), closed_form)
            call t%at_most(trim(names(shape))//'-top-keeps-the-momentum-of-its-axis', kept, 4*eps)
        end do
    end subroutine check_symmetric_tops

    !> Momentum along one axis, the middle one among them: m stays, the body turns about it by m_j h/I_j.
    subroutine check_axes(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: names(3) = ['axis-1', 'axis-2', 'axis-3']
        type(stream) :: random
        real(wp) :: moments(3), m0(3), h, state(7), worst, moved, sideways
        real(qp) :: axis(3), angle
        integer :: i, j

        do j = 1, 3
            worst = 0.0_wp
            moved = 0.0_wp
            sideways = 0.0_wp
            do i = 1, 200
                moments = random%triangle()
                m0 = 0.0_wp
                m0(j) = sign(random%log_uniform(-2.0_wp, 2.0_wp), random%uniform(-1.0_wp, 1.0_wp))
                h = random%log_uniform(-9.0_wp, 4.0_wp)/m0(j)
                state = advanced(moments, m0, h)
                axis = 0.0_qp
                axis(j) = 1.0_qp
                angle = real(m0(j), qp)*h/moments(j)
                moved = worst_of(moved, abs(state(j) - m0(j))/abs(m0(j)))
                state(j) = 0.0_wp
                sideways = worst_of(sideways, [abs(state(1:3))])
                worst = worst_of(worst, real(norm2(state(4:7) - turn_about(axis, angle)) &
                                        /(1 + abs(m0(j)*h)/minval(moments)), wp))
            end do
            call t%at_most('momentum-stays-along-'//names(j), sideways, 0.0_wp)
            call t%at_most('momentum-keeps-its-length-along-'//names(j), moved, 0.0_wp)
            call t%at_most('body-turns-about-'//names(j), worst, closed_form)
        end do
    end subroutine check_axes

    !> Deviations from the unstable axis over many decay times, alone and in lanes, with derivatives too: from
    !> 1e-104 on, where squares of the triple and of the momentum at mid-step could underflow; along the
    !> directions that approach and leave the axis, where the momentum at mid-step is a small difference.
    subroutine check_tiny_deviations(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [0.6_wp, 0.8_wp, 1.0_wp]
        real(wp), parameter :: ratio = sqrt(5/3.0_wp)       ! m3/m1 on the separatrix
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: m0(3), h, worst(4), m(3, 32), q(4, 32), transition(6, 6, 32)
        integer :: i

        body = rigid_body(moments)
        worst = 0.0_wp
        do i = 1, 4000
            if (mod(i, 2) == 0) then
                m0 = random%log_uniform(-104.0_wp, -60.0_wp)*random%direction()
            else
                m0(1) = random%log_uniform(-200.0_wp, 0.0_wp)
                m0(3) = merge(ratio, -ratio, mod(i, 4) == 1)*m0(1)
                m0(3) = m0(3)*(1 + random%log_uniform(-17.0_wp, -1.0_wp))
            end if
            m0(2) = 1.0_wp
            h = random%uniform(0.0_wp, 2500.0_wp)
            worst(1) = worst_of(worst(1), defect(moments, m0, advanced(moments, m0, h)))
            m = spread(m0, 2, 32)
            q = spread(no_turn, 2, 32)
            call free_flow(body, h, m(:, :8), q(:, :8))
            h = min(h, 1700.0_wp)       ! derivatives grow to exp(0.323 h)
            call flow_tangent(body, h, m(:, 9), q(:, 9), transition(:, :, 9))
            worst(2) = worst_of(worst(2), defect(moments, m0, made_finite([m(:, 5), q(:, 5)])))
            worst(3) = worst_of(worst(3), defect(moments, m0, made_finite([m(:, 9), q(:, 9)])))
            if (mod(i, 8) > 1) cycle
            m = spread(m0, 2, 32)
            q = spread(no_turn, 2, 32)
            call flow_tangent(body, h, m, q, transition)
            worst(4) = worst_of(worst(4), defect(moments, m0, made_finite([m(:, 5), q(:, 5)])))
        end do
        call t%at_most('next-to-the-unstable-axis-the-motion-stays-on-its-orbit', worst(1), 1.0e-12_wp)
        call t%at_most('next-to-the-unstable-axis-so-it-does-in-lanes', worst(2), 1.0e-12_wp)
        call t%at_most('next-to-the-unstable-axis-so-it-does-with-derivatives', worst(3), 1.0e-12_wp)
        call t%at_most('next-to-the-unstable-axis-so-it-does-with-derivatives-in-lanes', worst(4), 1.0e-12_wp)
    end subroutine check_tiny_deviations

    !> Moments 2, 3, 6 in any order and |m1| = |m3|: the separatrix to the last bit. From close to axis 2 the
    !> motion approaches it (side = 1), or leaves it and comes close to its other end (side = -1). With r =
    !> m1'/m1 = m3'/m3, up to terms (m1/|m|)^2, dm is half of a part along (m1, m3), that shifts the motion in
    !> time and becomes side r times it, and half of a part across, that the energy makes 1/r times it. Steps
    !> of 20 decay times, counted from the turn, to 700: beyond 300 they are joined from two parts.
    subroutine check_separatrix_derivatives(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: tolerance = 2.0e-12_wp
        integer, parameter :: orders(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, 3, 2, 1, 2, 1, 3, 1, 3, 2], &
                                                     [3, 6])
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: moments(3), a(3), m0(3), m(3), q(4), transition(6, 6), by_tensor(6, 6), growth
        real(wp) :: turn, decays, handed, log_r, r, truth(3, 3), by(3, 6), c, worst(4)
        integer, parameter :: row(6) = [1, 2, 3, 1, 1, 2], column(6) = [1, 2, 3, 2, 3, 3]
        integer :: i, side, o1, o2, o3, k

        worst = 0.0_wp
        do i = 1, 3000
            o1 = orders(1, 1 + mod(i, 6))
            o2 = orders(2, 1 + mod(i, 6))
            o3 = orders(3, 1 + mod(i, 6))
            handed = merge(1, -1, mod(i, 6) < 3)
            moments([o1, o2, o3]) = [2.0_wp, 3.0_wp, 6.0_wp]
            a = 1/moments
            body = rigid_body(moments)
            side = merge(1, -1, mod(i, 4) == 0)
            m0(o1) = sign(random%log_uniform(-102.0_wp, -10.0_wp), random%uniform(-1.0_wp, 1.0_wp))
            m0(o2) = sign(1.0_wp, random%uniform(-1.0_wp, 1.0_wp))
            turn = log(sqrt(2.0_wp)/abs(m0(o1)))
            decays = random%uniform(20.0_wp, 670.0_wp)
            log_r = -decays
            if (side < 0) then
                decays = turn + random%uniform(20.0_wp, 620.0_wp - turn)
                log_r = 2*turn - decays
            end if
            r = exp(log_r)
            decays = sign(decays, random%uniform(-1.0_wp, 1.0_wp))
            m0(o3) = sign(m0(o1), side*decays*handed*m0(o2)*m0(o1))
            truth = 0.0_wp
            truth(o1, o1) = 0.5_wp*(1/r + side*r)
            truth(o3, o1) = 0.5_wp*(side*r - 1/r)*sign(1.0_wp, m0(o1)*m0(o3))
            truth(o1, o3) = truth(o3, o1)
            truth(o3, o3) = truth(o1, o1)
            ! J m = m' + h dm'/dh
            truth(:, o2) = (1 - side - abs(decays))*(r/m0(o2))*m0
            truth(o2, :) = side*m0/m0(o2)
            truth(o2, [o1, o3]) = truth(o2, [o1, o3])*(1 - side*r**2)
            growth = maxval(abs(truth))
            m = m0
            q = no_turn
            call flow_tangent(body, 6*decays, m, q, transition, by_tensor=by_tensor)
            worst(1) = worst_of(worst(1), [abs(transition(1:3, 1:3) - truth)]/growth)
            ! Joined steps leave no rounding of `growth` along axis 2.
            if (abs(decays) > 301) worst(1) = worst_of(worst(1), abs(transition(o2, 1:3) - truth(o2, :)) &
                                                                 /max(1.0_wp, abs(truth(o2, :))))
            ! W from J = E + m'^ W and m' W = h a m.
            truth = handed*(truth - transition(4:6, 4:6))
            truth(o1, :) = truth(o1, :) + r*m0(o3)*transition(3 + o2, 1:3)
            truth(o3, :) = truth(o3, :) - r*m0(o1)*transition(3 + o2, 1:3)
            worst(2) = worst_of(worst(2), [abs(side*m0(o2)*transition(3 + o3, 1:3) - truth(o1, :)), &
                                           abs(side*m0(o2)*transition(3 + o1, 1:3) + truth(o3, :))]/growth)
            worst(2) = worst_of(worst(2), abs(transition(3 + o2, o2)/(6*decays*a(o2)) - side)/abs(decays))
            ! By the tensor only the growing part has so simple a form; off the diagonal a turn of the axes is
            ! beside it. dtheta2', which does not grow, is at most |h m| times the change of 1/I.
            if (r > 1.0e-10_wp) cycle
            by = 0.0_wp
            do k = 1, 6
                c = a(row(k))*a(column(k))*(m0(row(k))*m0(column(k)))
                if (k <= 3) c = 0.5_wp*a(row(k))**2*m0(o1)**2*merge(-2, 1, k == o2)
                by([o1, o3], k) = 3*c/r*[-1/m0(o1), 1/m0(o3)]
                if (k > 3 .and. r > 1.0e-15_wp) cycle
                worst(3) = worst_of(worst(3), abs(by_tensor(1:3, k) - by(:, k))/maxval(abs(by(:, k))))
                if (abs(decays) > 301) worst(4) = worst_of(worst(4), abs(by_tensor(3 + o2, k)) &
                                                   /(a(row(k))*a(column(k))*(6*abs(decays) + 36)))
            end do
        end do
        call t%at_most('from-end-to-end-of-the-separatrix: J', worst(1), tolerance)
        call t%at_most('from-end-to-end-of-the-separatrix: W', worst(2), tolerance)
        call t%at_most('from-end-to-end-of-the-separatrix: m by the tensor', worst(3), tolerance)
        call t%at_most('from-end-to-end-of-the-separatrix: turn about axis 2 by the tensor', worst(4), 1.0_wp)
    end subroutine check_separatrix_derivatives

    !> I = 2, 3, 6 and |m1| = |m3|: the separatrix to the last bit. m2 = |m| tanh(kappa), m1 and m3 fall as
    !> sech(kappa), kappa grows by +-|m| h/6; and as the energy is that of a turn about axis 2, that axis
    !> precesses about m evenly, by |m| h/I2. Long steps end on axis 2.
    subroutine check_separatrix(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [2.0_wp, 3.0_wp, 6.0_wp]
        type(stream) :: random
        type(rigid_body) :: body
        integer, parameter :: short = 150
        type(reference_case) :: it
        real(wp) :: m0(3), m(3), a(3, 3), h, worst(2), far
        real(qp) :: g, kappa, psi, n0(3), f(3), m_true(3), from(3, 3), to(3, 3), truth(3, 3)
        real(qp) :: sign_13, across
        integer :: i

        body = rigid_body(moments)
        worst = 0.0_wp
        far = 0.0_wp
        do i = 1, 2*short
            ! Long steps start far from axis 2: next to it (|m|/m1)^2 roundings are inherent.
            m0(1) = sign(random%log_uniform(merge(-0.5_wp, -6.0_wp, i > short), 0.0_wp), &
                         random%uniform(-1.0_wp, 1.0_wp))
            m0(2) = random%uniform(-1.0_wp, 1.0_wp)
            m0(3) = sign(m0(1), random%uniform(-1.0_wp, 1.0_wp))
            h = sign(random%log_uniform(-4.0_wp, 2.0_wp), random%uniform(-1.0_wp, 1.0_wp))
            if (i > short) h = h*100
            m = m0
            a = no_rotation
            call free_flow(body, h, m, a)
            g = norm2(real(m0, qp))
            n0 = m0/g
            sign_13 = sign(1.0_wp, m0(1)*m0(3))
            across = norm2(real([m0(1), m0(3)], qp))
            kappa = sign(log((g + abs(m0(2)))/across), real(m0(2), qp)) + sign_13*g*h/6
            m_true = [real(m0(1), qp), 0.0_qp, real(m0(3), qp)]*(g/across/cosh(kappa))
            m_true(2) = g*tanh(kappa)
            ! Axis 2 in space: at the angle of m_true to n0, its azimuth psi from where it was at the start.
            f = [0.0_qp, 1.0_qp, 0.0_qp] - n0(2)*n0
            f = f/norm2(f)
            psi = g*h/3
            ! Three vectors in both frames: m, the part of axis 2 across m, and their vector product.
            from(:, 1) = m_true/g
            from(:, 2) = [-tanh(kappa)*m0(1)/across, 1/cosh(kappa), -tanh(kappa)*m0(3)/across]
            from(:, 3) = cross4(from(:, 1), from(:, 2))
            to(:, 1) = n0
            to(:, 2) = f*cos(psi) + cross4(n0, f)*sin(psi)
            to(:, 3) = cross4(to(:, 1), to(:, 2))
            truth = matmul(to, transpose(from))
            if (i > short) then
                far = worst_of(far, [real(norm2(made_finite(m) - m_true)/g/(1 + abs(g*h)), wp), &
                          real(norm2(made_finite([a]) - [truth])/(1 + abs(g*h)), wp)])
                cycle
            end if
            it = true_case(moments, m0, h)
            it%m = m_true
            worst(1) = worst_of(worst(1), score_momentum(it, made_finite(m)))
            worst(2) = worst_of(worst(2), &
                real(norm2(reshape(made_finite([a]) - [truth], [9]))/sqrt(2.0_qp), wp)/(eps + it%sens_q))
        end do
        call t%at_most('separatrix-momentum-is-hyperbolic', worst(1), separatrix_score)
        call t%at_most('separatrix-attitude-precesses-evenly', worst(2), separatrix_score)
        call t%at_most('separatrix-settles-on-the-middle-axis-and-turns-on', far, 4*closed_form)
    end subroutine check_separatrix

    pure function cross4(u, v) result(w)
        real(qp), intent(in) :: u(3), v(3)
        real(qp) :: w(3)

        w = [u(2)*v(3) - u(3)*v(2), u(3)*v(1) - u(1)*v(3), u(1)*v(2) - u(2)*v(1)]
    end function cross4

    !> From 1e-2 to 1e-16 on both sides of the separatrix, steps of 0.1 to 25, one body and in a batch.
    subroutine check_both_sides(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        type(reference_case) :: it
        real(wp) :: moments(3), m0(3), h, state(7), m(3, 40), q(4, 40), m1(3), q1(4), worst(2), batch(2)
        integer :: i, j, side

        worst = 0.0_wp
        batch = 0.0_wp
        do i = 2, 16
            do side = -1, 1, 2
                do j = 1, 3
                    moments = random%triangle()
                    m0 = near_separatrix(random, moments, side*10.0_wp**(-i))
                    h = sign(random%log_uniform(-1.0_wp, 1.4_wp), random%uniform(-1.0_wp, 1.0_wp))
                    it = true_case(moments, m0, h)
                    state = advanced(moments, m0, h)
                    worst(1) = worst_of(worst(1), score_momentum(it, state(1:3)))
                    worst(2) = worst_of(worst(2), score_attitude(it, state(4:7)))
                    m = spread(m0, 2, size(m, 2))
                    q = spread(no_turn, 2, size(q, 2))
                    call free_flow(rigid_body(moments), h, m, q)
                    m1 = m(:, 5)
                    q1 = q(:, 5)
                    batch(1) = worst_of(batch(1), score_momentum(it, made_finite(m1)))
                    batch(2) = worst_of(batch(2), score_attitude(it, made_finite(q1)))
                end do
            end do
        end do
        call t%at_most('both-sides-of-the-separatrix: m', worst(1), separatrix_score)
        call t%at_most('both-sides-of-the-separatrix: q', worst(2), separatrix_score)
        call t%at_most('both-sides-of-the-separatrix-in-a-batch: m', batch(1), separatrix_score)
        call t%at_most('both-sides-of-the-separatrix-in-a-batch: q', batch(2), separatrix_score)
    end subroutine check_both_sides

end module frb_test_flow_limits
