!> Laws that the derivatives of the exact step obey: Poisson map, conserved quantities, scaling, group; and
!> their values where a formula could fail.
module frb_test_tangent_laws
    use frb_checks, only: tally, largest, worst_of
    use frb_flow_samples, only: stream, no_turn, no_rotation
    use frb_free_flow, only: flow_tangent, free_flow, rigid_body
    use frb_kinds, only: wp, unit_roundoff
    use frb_rotations, only: cross, norm3
    use frb_status, only: status_ok, status_bad_momentum, status_bad_time, status_bad_attitude, &
        status_bad_moments, status_bad_count
    use frb_tangent_cases, only: tangent_case, read_tangent_cases, hat
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf, ieee_is_nan, &
        ieee_is_finite
    use, intrinsic :: ieee_exceptions, only: ieee_overflow, ieee_get_halting_mode, ieee_set_halting_mode
    implicit none
    private

    public :: test_tangent_laws

    real(wp), parameter :: eps = epsilon(1.0_wp)

    !> Largest residuals, in units of 2^-53 of the norms involved: twice those measured on 1306 cases.
    integer, parameter :: laws = 12
    character(*), parameter :: law_names(laws) = [character(40) :: 'J-m^-J^T-is-m''^', 'm''^T-J-is-m^T', &
        'J-keeps-the-energy', 'determinant-of-J-is-1', 'J-is-E-and-m''^-W', 'E^T-W-W^T-E-is-W^T-m''^-W', &
        'J-carries-the-flow', 'W-f-is-a-m''-E-a-m', 'J-m-is-m''-and-h-f''', 'W-m-is-h-a-m''', &
        'moments-and-time-scale-together', 'energy-by-the-moments']
    real(wp), parameter :: law_bars(laws) = 2*[6.0_wp, 2.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 4.0_wp, 1.5_wp, &
                                               3.0_wp, 34.0_wp, 34.0_wp, 12.0_wp, 12.0_wp]

contains

    subroutine test_tangent_laws(t)
        type(tally), intent(inout) :: t

        call t%open_suite('tangent-laws', 48)
        call check_identities(t)
        call check_group(t)
        call check_rest(t)
        call check_scaling(t)
        call check_rotor(t)
        call check_refusals(t)
        call check_extremes(t)
        call t%close_suite()
    end subroutine test_tangent_laws

    !> The identities on all cases of data/reference.
    subroutine check_identities(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: files(3) = [character(42) :: 'data/reference/tangent_cases.txt', &
            'data/reference/tangent_cases_seed500.txt', 'data/reference/tangent_limits.txt']
        type(tangent_case), allocatable :: cases(:)
        real(wp) :: worst(laws)
        integer :: i, k

        worst = 0.0_wp
        do k = 1, 3
            call read_tangent_cases(trim(files(k)), cases)
            do i = 1, size(cases)
                worst = worst_of(worst, residuals(cases(i)))
            end do
        end do
        do i = 1, laws
            call t%at_most(trim(law_names(i)), worst(i), law_bars(i))
        end do
    end subroutine check_identities

    !> Residuals of one case in units of 2^-53; 1e30 for NaN; 0 where J^2 overflows.
    function residuals(it) result(r)
        type(tangent_case), intent(in) :: it
        real(wp) :: r(laws)
        real(wp) :: m(3), q(4), phi(6, 6), by(6, 3), am0(3), am(3), f0(3), f(3), g, nj, nw, scale
        integer :: k

        m = it%m0
        q = no_turn
        call flow_tangent(it%body, it%h, m, q, phi, by)
        r = 0.0_wp
        if (maxval(abs(phi)) > 1.0e50_wp) return
        g = norm3(it%m0)
        am0 = it%m0/it%moments
        am = m/it%moments
        f0 = cross(it%m0, am0)
        f = cross(m, am)
        associate (j => phi(1:3, 1:3), w => phi(4:6, 1:3), e => phi(4:6, 4:6), h => it%h)
            nj = norm2(j)
            nw = norm2(w)
            scale = norm3(am) + norm3(am0)
            r(1) = norm2(matmul(j, matmul(hat(it%m0), transpose(j))) - hat(m))/(nj**2*g)
            r(2) = norm3(matmul(m, j) - it%m0)/(nj*g)
            r(3) = norm3(matmul(am, j) - am0)/(nj*scale)
            r(4) = abs(dot_product(j(:, 1), cross(j(:, 2), j(:, 3))) - 1)/nj**3
            r(5) = norm2(j - e - matmul(hat(m), w))/(nj + nw*g)
            r(6) = norm2(matmul(transpose(e), w) - matmul(transpose(w), e) &
                         - matmul(transpose(w), matmul(hat(m), w)))/(nw + nw**2*g + tiny(1.0_wp))
            r(7) = norm3(matmul(j, f0) - f)/(nj*g*scale)
            r(8) = norm3(matmul(w, f0) - (am - matmul(e, am0)))/((nw*g + 1)*scale)
            r(9) = norm3(matmul(j, it%m0) - (m + h*f))/(nj*g + abs(h)*g*scale)
            r(10) = norm3(matmul(w, it%m0) - h*am)/(nw*g + abs(h)*scale + tiny(1.0_wp))
            r(11) = norm3(matmul(by(4:6, :), it%moments) + h*am) &
                    /(sum(abs(matmul(abs(by(4:6, :)), it%moments))) + tiny(1.0_wp))
            do k = 1, 3
                r(12) = worst_of(r(12), abs(dot_product(am, by(1:3, k)) &
                                       - (m(k)**2 - it%m0(k)**2)/(2*it%moments(k)**2)) &
                            /(norm3(am)*g*norm3(by(4:6, k)) + (g/it%moments(k))**2))
            end do
        end associate
        r = r/unit_roundoff
        where (.not. r < 1.0e30_wp) r = 1.0e30_wp
    end function residuals

    !> Two steps are one, there and back is none, for bodies by moments, also with their inertia, and by a
    !> tensor.
    subroutine check_group(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: moments(3), m0(3), m(3), q(4), phi1(6, 6), phi2(6, 6), phi(6, 6), by1(6, 6), by2(6, 6), &
            by(6, 6)
        real(wp) :: h1, h2, tensor(3, 3), worst(4), identity(6, 6), jacobian(3, 3)
        integer :: i, k

        worst = 0.0_wp
        identity = 0.0_wp
        do i = 1, 6
            identity(i, i) = 1.0_wp
        end do
        do i = 1, 300
            moments = random%triangle()
            moments = cshift(moments, mod(i, 3))
            if (mod(i, 2) == 0) moments([1, 3]) = moments([3, 1])
            tensor = 0.0_wp
            do k = 1, 3
                tensor(k, k) = moments(k)
            end do
            if (mod(i, 5) == 0) tensor = tensor + 0.1_wp*spread(random%direction(), 1, 3)*spread(m0, 2, 3)
            tensor = 0.5_wp*(tensor + transpose(tensor))
            body = rigid_body(tensor)
            if (body%status() /= status_ok) cycle
            m0 = random%direction()
            h1 = random%log_uniform(-3.0_wp, 0.5_wp)
            h2 = random%log_uniform(-3.0_wp, 0.5_wp)
            m = m0
            q = no_turn
            call flow_tangent(body, h1, m, q, phi1, by_tensor=by1)
            call flow_tangent(body, h2, m, q, phi2, by_tensor=by2)
            m = m0
            q = no_turn
            call flow_tangent(body, h1 + h2, m, q, phi, by_tensor=by)
            worst(1) = worst_of(worst(1), norm2(matmul(phi2, phi1) - phi)/(norm2(phi2)*norm2(phi1)))
            worst(2) = worst_of(worst(2), norm2(matmul(phi2, &
                                                  by1) + by2 - by)/(norm2(phi2)*norm2(by1) + norm2(by2)))
            call flow_tangent(body, -(h1 + h2), m, q, phi1)
            worst(3) = worst_of(worst(3), norm2(matmul(phi1, phi) - identity)/(norm2(phi1)*norm2(phi)))
            m = m0
            call flow_tangent(body, h1 + h2, m, jacobian)
            worst(4) = worst_of(worst(4), norm2(jacobian - phi(1:3, 1:3))/norm2(jacobian))
        end do
        call t%at_most('two-steps-are-one', worst(1), 20*eps)
        call t%at_most('two-steps-are-one-by-the-tensor', worst(2), 20*eps)
        call t%at_most('there-and-back-is-none', worst(3), 20*eps)
        call t%at_most('momentum-alone-is-the-same', worst(4), 8*eps)
    end subroutine check_group

    !> No momentum and no time.
    subroutine check_rest(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [0.8_wp, 1.0_wp, 0.6_wp], h = 0.7_wp
        real(wp) :: tensor(3, 3), m(3), q(4), phi(6, 6), by(6, 6), by_moments(6, 3), expected(6, 6), &
            jacobian(3, 3)
        integer :: i

        expected = 0.0_wp
        do i = 1, 3
            expected(i, i) = 1.0_wp
            expected(3 + i, 3 + i) = 1.0_wp
            expected(3 + i, i) = h/moments(i)
        end do
        m = 0.0_wp
        q = no_turn
        call flow_tangent(rigid_body(moments), h, m, q, phi, by_moments)
        call t%at_most('from-rest-W-is-h-over-I', largest([abs(phi - expected)]), eps)
        call t%at_most('from-rest-no-derivative-by-the-moments', largest([abs(by_moments)]), 0.0_wp)
        m = 0.0_wp
        call flow_tangent(rigid_body(moments), h, m, jacobian)
        call t%at_most('from-rest-J-is-1', largest([abs(jacobian - no_rotation)]), 0.0_wp)
        tensor = reshape([2.0_wp, 0.5_wp, 0.25_wp, 0.5_wp, 3.0_wp, -0.5_wp, 0.25_wp, -0.5_wp, 2.5_wp], [3, 3])
        call flow_tangent(rigid_body(tensor), h, m, q, phi, by_tensor=by)
        call t%at_most('from-rest-W-is-h-over-the-tensor', &
                       largest([abs(matmul(tensor, phi(4:6, 1:3)) - h*no_rotation)]), 8*eps)
        m = [0.3_wp, 0.2_wp, -0.5_wp]
        expected(4:6, 1:3) = 0.0_wp
        call flow_tangent(rigid_body(tensor), 0.0_wp, m, q, phi, by_tensor=by)
        call t%at_most('no-time-is-the-identity', largest([abs(phi - expected)]), 0.0_wp)
        call t%at_most('no-time-no-derivative-by-the-tensor', largest([abs(by)]), 0.0_wp)
        ! A sphere turns uniformly: J = 1, m W m = h m m/I; small momenta come close to rest.
        m = [0.3_wp, 0.2_wp, -0.5_wp]
        call flow_tangent(rigid_body([2.0_wp, 2.0_wp, 2.0_wp]), 3.0_wp, m, q, phi)
        call t%at_most('sphere-keeps-its-momentum', largest([abs(phi(1:3, 1:3) - no_rotation)]), 4*eps)
        m = [0.3_wp, 0.2_wp, -0.5_wp]*1.0e-200_wp
        call flow_tangent(rigid_body(moments), h, m, q, phi)
        call t%at_most('nearly-at-rest-W-is-h-over-I', &
                       largest([abs(phi(4:6, 1:3) - h*diagonal(1/moments))]), &
                       2*eps)
    end subroutine check_rest

    pure function diagonal(d) result(x)
        real(wp), intent(in) :: d(3)
        real(wp) :: x(3, 3)

        x = spread(d, 2, 3)*no_rotation
    end function diagonal

    !> Units by powers of 2, from the smallest to the largest, change no digit.
    subroutine check_scaling(t)
        type(tally), intent(inout) :: t
        integer, parameter :: of_moment(5) = [0, 300, -300, 900, -900], of_momentum(5) = [0, -400, 500, 90, &
                                                                                          -60]
        real(wp), parameter :: moments(3) = [1.0_wp, 0.6_wp, 0.8_wp], m0(3) = [0.5_wp, -0.7_wp, 0.6_wp]
        real(wp) :: m(3), q(4), phi(6, 6), by(6, 3), phi0(6, 6), by0(6, 3), h, worst(4), jacobian(3, 3)
        real(wp) :: jacobian0(3, 3)
        integer :: i, k

        worst = 0.0_wp
        do k = 1, 3
            h = 10.0_wp**(2*k - 4)
            do i = 1, 5
                associate (moment => of_moment(i), momentum => of_momentum(i))
                    m = scale(m0, momentum)
                    q = no_turn
                    call flow_tangent(rigid_body(scale(moments, moment)), scale(h, moment - momentum), m, q, &
                                      phi, by)
                    phi(4:6, 1:3) = scale(phi(4:6, 1:3), momentum)
                    by(1:3, :) = scale(by(1:3, :), moment - momentum)
                    by(4:6, :) = scale(by(4:6, :), moment)
                    if (i == 1) then
                        phi0 = phi
                        by0 = by
                    end if
                    worst(1) = worst_of(worst(1), [abs(phi - phi0)])
                    worst(2) = worst_of(worst(2), [abs(by - by0)])
                    m = scale(m0, momentum)
                    call flow_tangent(rigid_body(scale(moments, moment)), scale(h, moment - momentum), m, &
                                      jacobian)
                    if (i == 1) jacobian0 = jacobian
                    worst(3) = worst_of(worst(3), [abs(jacobian - jacobian0)])
                end associate
            end do
        end do
        call t%at_most('units-change-no-digit-of-the-transition', worst(1), 0.0_wp)
        call t%at_most('units-change-no-digit-by-the-moments', worst(2), 0.0_wp)
        call t%at_most('units-change-no-digit-of-J-alone', worst(3), 0.0_wp)
    end subroutine check_scaling

    !> A linear rotor: a sphere without momentum along its axis.
    subroutine check_rotor(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: axis(3) = [0.6_wp, 0.0_wp, 0.8_wp]
        real(wp) :: m(3), m0(3), q(4), phi(6, 6), sphere(6, 6), jacobian(3, 3), by(6, 3), tensor(3, 3)
        integer :: code

        m0 = [0.0_wp, 0.5_wp, 0.3_wp]
        m = m0
        q = no_turn
        call flow_tangent(rigid_body([2.0_wp, 2.0_wp, 2.0_wp]), 0.9_wp, m, q, sphere)
        m = m0
        q = no_turn
        call flow_tangent(rigid_body([0.0_wp, 2.0_wp, 2.0_wp]), 0.9_wp, m, q, phi, by)
        call t%at_most('rotor-turns-as-a-sphere', largest([abs(phi(:, 2:6) - sphere(:, 2:6))]), 2*eps)
        call t%at_most('rotor-has-no-derivative-along-its-axis', largest([abs(phi(:, 1))]), 2*eps)
        call t%close_to('rotor-by-its-moment', by(4:6, 2) + by(4:6, 3), -0.9_wp*m0/4, 4*eps)
        ! The same in other axes.
        tensor = 2*(no_rotation - spread(axis, 2, 3)*spread(axis, 1, 3))
        m0 = [0.8_wp, 0.3_wp, -0.6_wp]
        m = m0
        q = no_turn
        call flow_tangent(rigid_body([2.0_wp, 2.0_wp, 2.0_wp]), 0.9_wp, m, q, sphere)
        m = m0
        q = no_turn
        call flow_tangent(rigid_body(tensor), 0.9_wp, m, q, phi)
        sphere(:, 1:3) = matmul(sphere(:, 1:3), no_rotation - spread(axis, 2, 3)*spread(axis, 1, 3))
        call t%at_most('rotor-by-a-tensor', largest([abs(phi - sphere)]), 16*eps)
        m = m0
        call flow_tangent(rigid_body(tensor), 0.9_wp, m, jacobian)
        call t%at_most('rotor-by-a-tensor-momentum-alone', largest([abs(jacobian - phi(1:3, 1:3))]), 2*eps)
        m = axis
        call flow_tangent(rigid_body(tensor), 0.9_wp, m, jacobian, code)
        call t%equal('rotor-does-not-spin', code, status_bad_momentum)
    end subroutine check_rotor

    !> Input that is refused, and the results of a refused call.
    subroutine check_refusals(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: body
        real(wp) :: m(3), q(4), phi(6, 6), nan, inf, by(6, 6), odd(6, 4), jacobian(3, 3)
        integer :: code

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        inf = ieee_value(1.0_wp, ieee_positive_inf)
        body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        m = [1.0_wp, nan, 0.0_wp]
        q = no_turn
        call flow_tangent(body, 1.0_wp, m, q, phi, code)
        call t%equal('momentum-that-is-no-number', code, status_bad_momentum)
        m = 1.0_wp
        call flow_tangent(body, inf, m, q, phi, code)
        call t%equal('time-that-is-not-finite', code, status_bad_time)
        q = 0.0_wp
        call flow_tangent(body, 1.0_wp, m, q, phi, by, code)
        call t%equal('attitude-of-norm-zero', code, status_bad_attitude)
        call t%at_most('refused-momentum-is-left-alone', largest([abs(m - 1)]), 0.0_wp)
        call t%at_most('refused-step-has-no-derivative-by-the-inertia', largest([abs(by)]), 0.0_wp)
        call t%at_most('refused-step-is-the-identity', largest([abs(phi(1:3, 1:3) - no_rotation)]) &
                       + largest([abs(phi(4:6, 4:6) - no_rotation)]) + largest([abs(phi(4:6, 1:3))]), 0.0_wp)
        q = no_turn
        call flow_tangent(rigid_body([1.0_wp, -1.0_wp, 1.0_wp]), 1.0_wp, m, jacobian, code)
        call t%equal('body-that-could-not-be-made', code, status_bad_moments)
        call flow_tangent(body, 1.0_wp, m, q, phi, odd, code)
        call t%equal('columns-of-no-inertia', code, status_bad_count)
        call flow_tangent(body, 1.0_wp, m, q, phi, by(:, 1:3), code)
        call t%equal('columns-of-moments', code, status_ok)
        call t%at_most('columns-of-moments-and-of-a-tensor-agree', difference_of_columns(), 0.0_wp)
    end subroutine check_refusals

    !> Derivatives by the moments of a body, against those by the diagonal of its tensor.
    function difference_of_columns() result(difference)
        real(wp) :: difference
        real(wp) :: m(3), q(4), phi(6, 6), by_moments(6, 3), by_tensor(6, 6)

        m = [0.3_wp, 0.2_wp, -0.5_wp]
        q = no_turn
        call flow_tangent(rigid_body([1.0_wp, 0.6_wp, 0.8_wp]), 5.0_wp, m, q, phi, by_moments)
        m = [0.3_wp, 0.2_wp, -0.5_wp]
        q = no_turn
        call flow_tangent(rigid_body([1.0_wp, 0.6_wp, 0.8_wp]), 5.0_wp, m, q, phi, by_tensor)
        difference = maxval(abs(by_moments - by_tensor(:, 1:3)))
    end function difference_of_columns

    !> Numbers of all exponents: no NaN; Inf on the unstable axis only where exp(lambda h) is beyond numbers.
    subroutine check_extremes(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        real(wp) :: moments(3), m0(3), m(3), q(4), m_free(3), q_free(4), h, phi(6, 6), by(6, 6), lambda, worst
        real(wp) :: tensor(3, 3)
        integer :: i, k, nans, far
        logical :: halting

        call ieee_get_halting_mode(ieee_overflow, halting)
        call ieee_set_halting_mode(ieee_overflow, .false.)
        nans = 0
        worst = 0.0_wp
        do i = 1, 4000
            do k = 1, 3
                moments(k) = random%log_uniform(-3.0_wp, 3.0_wp)
                m0(k) = random%log_uniform(-20.0_wp, 0.0_wp)*sign(1.0_wp, random%uniform(-1.0_wp, 1.0_wp))
                if (random%uniform(0.0_wp, 1.0_wp) < 0.2_wp) m0(k) = 0.0_wp
            end do
            if (mod(i, 3) == 0) moments(1 + mod(i, 2)) = moments(3)
            moments = moments*random%log_uniform(-100.0_wp, 100.0_wp)
            m0 = m0*random%log_uniform(-150.0_wp, 150.0_wp)
            h = random%log_uniform(-160.0_wp, 160.0_wp)
            if (mod(i, 4) > 0 .and. maxval(abs(m0)) > 0.0_wp) then
                h = random%log_uniform(-3.0_wp, 5.0_wp)*(minval(moments)/maxval(abs(m0)))
            end if
            m = m0
            q = no_turn
            call flow_tangent(rigid_body(moments), h, m, q, phi, by_tensor=by)
            if (any(ieee_is_nan(phi)) .or. any(ieee_is_nan(by)) .or. any(ieee_is_nan(m))) nans = nans + 1
            m_free = m0
            q_free = no_turn
            call free_flow(rigid_body(moments), h, m_free, q_free)
            if (abs(h)*maxval(abs(m0))/minval(moments) < 1.0_wp) worst = worst_of(worst, [abs(q - q_free)])
        end do
        call t%equal('no-derivative-is-nan', nans, 0)
        call t%at_most('attitude-is-that-of-free-flow', worst, 4*eps)
        lambda = sqrt((1/2.0_wp - 1/3.0_wp)*(1/3.0_wp - 1/6.0_wp))
        far = 0
        do i = 1, 400
            m = [0.0_wp, 1.0_wp, 0.0_wp]
            q = no_turn
            call flow_tangent(rigid_body([2.0_wp, 3.0_wp, 6.0_wp]), 20.0_wp*i/lambda, m, q, phi, by_tensor=by)
            if (any(ieee_is_nan(phi)) .or. any(ieee_is_nan(by))) far = far + 1
            ! J_11 = cosh(lambda h)
            if (ieee_is_finite(phi(1, 1)) .neqv. 20*i <= 700) far = far + 1
        end do
        call t%equal('unstable-axis-overflows-where-it-must', far, 0)
        ! A body by a tensor, almost a sphere: in its axes the derivative overflows in several elements.
        nans = 0
        far = 0
        tensor = 0.0_wp
        tensor(1, 1) = 0.41025388077387226_wp
        tensor(2, 2) = 0.41025388077387220_wp
        tensor(3, 3) = 0.41025388077387215_wp
        tensor(2, 3) = -1.3877787807814457e-17_wp
        tensor(3, 2) = tensor(2, 3)
        do i = 10, 140, 10
            m = [0.0_wp, 10.0_wp**i, 0.0_wp]
            q = no_turn
            call flow_tangent(rigid_body(tensor), 3.098_wp, m, q, phi, by_tensor=by)
            if (any(ieee_is_nan(phi)) .or. any(ieee_is_nan(by))) nans = nans + 1
            if (.not. ieee_is_finite(phi(1, 1))) far = far + 1
        end do
        call t%equal('by-a-tensor-no-derivative-is-nan', nans, 0)
        call t%ok('by-a-tensor-derivatives-overflow', far >= 5)
        call ieee_set_halting_mode(ieee_overflow, halting)
    end subroutine check_extremes

end module frb_test_tangent_laws
