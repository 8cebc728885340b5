!> Conversions between frames and variables, and the Langevin kick.
module frb_test_frames
    use frb_checks, only: tally, worst_of, largest
    use frb_flow_samples, only: stream
    use frb_frames, only: angular_velocity, angular_momentum, quat_rotate, quat_rotate_back, quat_momentum, &
        momentum_from_quat
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp, pi
    use frb_rotations, only: quat_conjugate, quat_product, quat_to_matrix
    use frb_status, only: status_ok, status_bad_count, status_bad_moments, status_bad_momentum, &
        status_bad_option, status_bad_time
    use frb_thermostats, only: langevin_kick
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: test_frames

    real(wp), parameter :: eps = epsilon(1.0_wp)
    integer, parameter :: n = 37
    real(wp), parameter :: tensor(3, 3) = reshape([1.0_wp, 0.2_wp, 0.1_wp, 0.2_wp, 1.5_wp, -0.3_wp, &
                                                   0.1_wp, -0.3_wp, 2.0_wp], [3, 3])

contains

    subroutine test_frames(t)
        type(tally), intent(inout) :: t

        call t%open_suite('frames', 55)
        call test_rotations(t)
        call test_inertia(t)
        call test_kick(t)
        call test_kick_shapes(t)
        call test_kick_refused(t)
        call test_canonical(t)
        call t%close_suite()
    end subroutine test_frames

    !> Unit quaternions and vectors.
    subroutine samples(q, v)
        real(wp), intent(out) :: q(4, n), v(3, n)
        type(stream) :: random
        integer :: i, k

        do i = 1, n
            do k = 1, 4
                q(k, i) = random%uniform(-1.0_wp, 1.0_wp)
            end do
            q(:, i) = q(:, i)/norm2(q(:, i))
            v(:, i) = random%log_uniform(-2.0_wp, 2.0_wp)*random%direction()
        end do
    end subroutine samples

    !> Calls with arrays against calls one by one, these against matrices and the Hamilton product.
    subroutine test_rotations(t)
        type(tally), intent(inout) :: t
        real(wp) :: q(4, n), v(3, n), w(3, n), back(3, n), p4(4, n), worst(8), size_of_v, expected(4)
        integer :: i

        call samples(q, v)
        w = quat_rotate(q, v)
        back = quat_rotate_back(q, v)
        p4 = quat_momentum(q, v)
        worst = 0.0_wp
        do i = 1, n
            size_of_v = norm2(v(:, i))
            worst(1) = worst_of(worst(1), norm2(w(:, i) - matmul(quat_to_matrix(q(:, i)), v(:, i)))/size_of_v)
            worst(2) = worst_of(worst(2), norm2(back(:, i) - matmul(v(:, i), quat_to_matrix(q(:, i)))) &
                                /size_of_v)
            worst(3) = worst_of(worst(3), norm2(w(:, i) - quat_rotate(q(:, i), v(:, i)))/size_of_v)
            worst(4) = worst_of(worst(4), norm2(back(:, i) - quat_rotate_back(q(:, i), v(:, i)))/size_of_v)
            expected = 2*quat_product(q(:, i), [0.0_wp, v(:, i)])
            worst(5) = worst_of(worst(5), norm2(p4(:, i) - expected)/size_of_v)
            worst(6) = worst_of(worst(6), norm2(quat_momentum(q(:, i), v(:, i)) - expected)/size_of_v)
            worst(7) = worst_of(worst(7), norm2(momentum_from_quat(q(:, i), p4(:, i)) - v(:, i))/size_of_v)
        end do
        call t%at_most('arrays-are-rotated-as-by-the-matrix', worst(1), 4*eps)
        call t%at_most('arrays-are-rotated-back-as-by-its-transpose', worst(2), 4*eps)
        call t%at_most('arrays-are-rotated-as-one-by-one', worst(3), 2*eps)
        call t%at_most('arrays-are-rotated-back-as-one-by-one', worst(4), 2*eps)
        call t%at_most('quaternion-momenta-are-twice-q-times-m', worst(5), 4*eps)
        call t%at_most('so-is-one-quaternion-momentum', worst(6), 4*eps)
        call t%at_most('the-momentum-comes-back-from-the-quaternion-momentum', worst(7), 4*eps)
        back = momentum_from_quat(q, p4)
        call t%at_most('and-so-do-arrays', largest([norm2(back - v, dim=1)/norm2(v, dim=1)]), 4*eps)
        back = quat_rotate_back(q, w)
        call t%at_most('back-and-forth-is-the-start', &
                       largest([norm2(back - v, dim=1)/norm2(v, dim=1)]), 4*eps)
        call t%ok('rotating-arrays-that-do-not-match-is-nan', &
                  all(ieee_is_nan(quat_rotate(q(:, 2:), v))) .and. all(ieee_is_nan(quat_rotate_back(v, v))) &
                  .and. all(ieee_is_nan(quat_rotate(q, q))))
        call t%ok('converting-arrays-that-do-not-match-is-nan', &
                  all(ieee_is_nan(quat_momentum(q(:, 2:), v))) .and. all(ieee_is_nan(quat_momentum(v, v))) &
                  .and. all(ieee_is_nan(momentum_from_quat(q(:, 2:), p4))) &
                  .and. all(ieee_is_nan(momentum_from_quat(q, v))))
        call t%ok('no-vectors-at-all-are-fine', size(quat_rotate(q(:, 1:0), v(:, 1:0))) == 0)
    end subroutine test_rotations

    !> omega and m.
    subroutine test_inertia(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: body, turned, rod, none, many(n)
        real(wp) :: q(4, n), v(3, n), w(3, n), axis(3)
        integer :: i

        call samples(q, v)
        body = rigid_body([3.0_wp, 1.0_wp, 2.0_wp])
        turned = rigid_body(tensor)
        call t%close_to('omega-is-m-over-the-moments', angular_velocity(body, [3.0_wp, 1.0_wp, 4.0_wp]), &
                        [1.0_wp, 1.0_wp, 2.0_wp], 4*eps)
        call t%close_to('m-is-the-moments-times-omega', angular_momentum(body, [1.0_wp, 1.0_wp, 2.0_wp]), &
                        [3.0_wp, 1.0_wp, 4.0_wp], 0.0_wp)
        call t%close_to('m-is-the-tensor-times-omega', angular_momentum(turned, [0.3_wp, -0.2_wp, 0.7_wp]), &
                        matmul(tensor, [0.3_wp, -0.2_wp, 0.7_wp]), 8*eps)
        call t%close_to('omega-comes-back-through-the-tensor', &
                        angular_velocity(turned, matmul(tensor, [0.3_wp, -0.2_wp, 0.7_wp])), &
                        [0.3_wp, -0.2_wp, 0.7_wp], 8*eps)
        w = angular_velocity(turned, v)
        call t%at_most('omegas-of-alike-bodies-go-through-the-tensor', &
                       largest([norm2(matmul(tensor, w) - v, dim=1)/norm2(v, dim=1)]), 16*eps)
        w = angular_momentum(turned, w)
        call t%at_most('and-their-momenta-come-back', largest([norm2(w - v, dim=1)/norm2(v, dim=1)]), 16*eps)
        w = angular_momentum(body, angular_velocity(body, v))
        call t%at_most('as-do-those-in-principal-axes', largest([norm2(w - v, dim=1)/norm2(v, dim=1)]), 4*eps)
        do i = 1, n
            many(i) = rigid_body([1.0_wp*i, 2.0_wp*i, 2.5_wp*i])
        end do
        many(5) = turned
        w = angular_velocity(many, v)
        call t%close_to('each-body-has-its-own-omega', [w(:, 5), w(:, 9)], &
                        [angular_velocity(turned, v(:, 5)), v(:, 9)/[9.0_wp, 18.0_wp, 22.5_wp]], 1.0e-13_wp)
        w = angular_momentum(many, w)
        call t%at_most('and-its-own-momentum', largest([norm2(w - v, dim=1)/norm2(v, dim=1)]), 16*eps)
        rod = rigid_body([2.0_wp, 0.0_wp, 2.0_wp])
        call t%close_to('omega-about-the-axis-of-a-rod-is-zero', &
                        angular_velocity(rod, [1.0_wp, 0.5_wp, 3.0_wp]), [0.5_wp, 0.0_wp, 1.5_wp], eps)
        call t%close_to('and-so-is-m', angular_momentum(rod, [1.0_wp, 0.5_wp, 3.0_wp]), &
                        [2.0_wp, 0.0_wp, 6.0_wp], eps)
        axis = [1.0_wp, 2.0_wp, -2.0_wp]/3
        rod = rigid_body(2*(quat_to_matrix([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]) &
                            - spread(axis, 1, 3)*spread(axis, 2, 3)))
        w(:, 1:2) = angular_velocity(rod, reshape([v(:, 1), 3*axis], [3, 2]))
        call t%close_to('of-a-rod-by-its-tensor-too', [dot_product(w(:, 1), axis), w(:, 2)], &
                        [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 64*eps)
        call t%ok('a-body-that-could-not-be-made-has-no-omega', &
                  all(ieee_is_nan(angular_velocity(none, v(:, 1)))) &
                  .and. all(ieee_is_nan(angular_velocity(none, v))) &
                  .and. all(ieee_is_nan(angular_momentum(none, v(:, 1)))))
        call t%ok('sizes-that-do-not-match-give-nan', all(ieee_is_nan(angular_velocity(many(2:), v))) &
                  .and. all(ieee_is_nan(angular_momentum(many, q))) &
                  .and. all(ieee_is_nan(angular_velocity(body, q))))
    end subroutine test_inertia

    !> The kick against its formula and its laws.
    subroutine test_kick(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: friction(3) = [0.5_wp, 1.0_wp, 4.0_wp], noise(3) = [0.7_wp, -1.1_wp, 0.4_wp]
        type(rigid_body) :: body, turned, rod
        real(wp) :: m(3), start(3), sigma(3), axes(3, 3), other(3)
        integer :: k

        body = rigid_body([1.0_wp, 4.0_wp, 2.25_wp])
        start = [1.8_wp, 0.4_wp, -0.9_wp]
        m = start
        call langevin_kick(body, friction, 0.36_wp, 0.25_wp, noise, m)
        call t%close_to('a-kick-is-the-formula', m, exp(-0.25_wp*friction)*start &
                        + sqrt(0.36_wp*body%moments()*(1 - exp(-0.5_wp*friction)))*noise, 8*eps)
        m = start
        call langevin_kick(body, friction, 0.36_wp, 0.0_wp, noise, m)
        call t%close_to('no-time-no-kick', m, start, 0.0_wp)
        m = start
        call langevin_kick(body, 0.0_wp, 0.36_wp, 5.0_wp, noise, m)
        call t%close_to('no-friction-no-kick', m, start, 0.0_wp)
        m = start
        call langevin_kick(body, 3.0_wp, 0.36_wp, 1.0e6_wp, noise, m)
        call t%close_to('after-a-long-time-only-noise-is-left', m, 0.6_wp*[1.0_wp, 2.0_wp, 1.5_wp]*noise, &
                        4*eps)
        call langevin_kick(body, 1.0e300_wp, 0.36_wp, 1.0e300_wp, noise, m)
        call t%close_to('at-any-friction-and-time', m, 0.6_wp*[1.0_wp, 2.0_wp, 1.5_wp]*noise, 4*eps)
        m = 0.0_wp
        call langevin_kick(body, 1.0e-12_wp, 1.0_wp, 1.0e-3_wp, noise, m)
        call t%close_to('short-kicks-lose-no-digits', m/noise, &
                        sqrt(2.0e-15_wp)*[1.0_wp, 2.0_wp, 1.5_wp], 1.0e-22_wp)
        ! Two half kicks leave the variance of one kick, and a kick keeps the canonical variance:
        ! sigma^2 + decay^2 = 1.
        sigma = 0.0_wp
        call langevin_kick(body, friction, 1.0_wp, 0.3_wp, [1.0_wp, 1.0_wp, 1.0_wp], sigma)
        m = [1.0_wp, 1.0_wp, 1.0_wp]
        call langevin_kick(body, friction, 0.0_wp, 0.3_wp, noise, m)
        call t%close_to('the-canonical-variance-stays', sigma**2/body%moments() + m**2, &
                        [1.0_wp, 1.0_wp, 1.0_wp], 8*eps)
        turned = rigid_body(tensor)
        axes = turned%axes()
        m = start
        call langevin_kick(turned, friction, 0.36_wp, 0.25_wp, noise, m)
        other = matmul(start, axes)
        call langevin_kick(rigid_body(turned%moments()), friction, 0.36_wp, 0.25_wp, noise, other)
        call t%close_to('a-body-by-its-tensor-is-kicked-in-its-principal-axes', m, matmul(axes, other), 8*eps)
        rod = rigid_body([0.0_wp, 2.0_wp, 2.0_wp])
        m = [1.0e-14_wp, 0.4_wp, -0.9_wp]
        call langevin_kick(rod, 1.0_wp, 0.5_wp, 0.25_wp, noise, m)
        call t%ok('a-rod-is-not-kicked-about-its-axis', abs(m(1)) <= 0.0_wp .and. abs(m(2) - 0.4_wp) > 0.1_wp)
        m = start
        do k = 1, 3
            call langevin_kick(body, friction, 0.0_wp, 0.1_wp, noise, m)
        end do
        call t%close_to('kicks-without-noise-compose', m, exp(-0.3_wp*friction)*start, 8*eps)
    end subroutine test_kick

    !> Calls with arrays against calls one by one.
    subroutine test_kick_shapes(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: friction(3) = [0.5_wp, 1.0_wp, 4.0_wp]
        type(rigid_body) :: body, many(n)
        real(wp) :: q(4, n), noise(3, n), m(3, n), singly(3, n)
        integer :: i

        call samples(q, noise)
        body = rigid_body([1.0_wp, 4.0_wp, 2.25_wp])
        do i = 1, n
            many(i) = rigid_body([1.0_wp*i, 2.0_wp*i, 2.5_wp*i])
        end do
        many(7) = rigid_body(tensor)
        m = q(1:3, :)
        singly = m
        call langevin_kick(body, friction, 0.7_wp, 0.2_wp, noise, m)
        do i = 1, n
            call langevin_kick(body, friction, 0.7_wp, 0.2_wp, noise(:, i), singly(:, i))
        end do
        call t%close_to('alike-bodies-are-kicked-as-one-by-one', [m], [singly], 0.0_wp)
        call langevin_kick(many, friction, 0.7_wp, 0.2_wp, noise, m)
        do i = 1, n
            call langevin_kick(many(i), friction, 0.7_wp, 0.2_wp, noise(:, i), singly(:, i))
        end do
        call t%close_to('bodies-are-kicked-as-one-by-one', [m], [singly], 0.0_wp)
        call langevin_kick(many, 0.3_wp, 0.7_wp, 0.2_wp, noise, m)
        call langevin_kick(many, [0.3_wp, 0.3_wp, 0.3_wp], 0.7_wp, 0.2_wp, noise, singly)
        call t%close_to('one-friction-is-that-of-all-axes', [m], [singly], 0.0_wp)
        call langevin_kick(body, 0.3_wp, 0.7_wp, 0.2_wp, noise, m)
        call langevin_kick(body, [0.3_wp, 0.3_wp, 0.3_wp], 0.7_wp, 0.2_wp, noise, singly)
        call t%close_to('so-it-is-for-alike-bodies', [m], [singly], 0.0_wp)
    end subroutine test_kick_shapes

    !> Each way a call can be wrong.
    subroutine test_kick_refused(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: body, none
        real(wp) :: m(3), noise(3), nan, all_m(3, 2)
        integer :: stat

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        body = rigid_body([1.0_wp, 4.0_wp, 2.25_wp])
        m = [1.8_wp, 0.4_wp, -0.9_wp]
        noise = 1.0_wp
        call langevin_kick(none, 1.0_wp, 1.0_wp, 1.0_wp, noise, m, stat)
        call refused('a-body-never-made', status_bad_moments)
        call langevin_kick(body, -1.0_wp, 1.0_wp, 1.0_wp, noise, m, stat)
        call refused('negative-friction', status_bad_option)
        call langevin_kick(body, [1.0_wp, nan, 1.0_wp], 1.0_wp, 1.0_wp, noise, m, stat)
        call refused('nan-friction', status_bad_option)
        call langevin_kick(body, 1.0_wp, -1.0_wp, 1.0_wp, noise, m, stat)
        call refused('negative-temperature', status_bad_option)
        call langevin_kick(body, 1.0_wp, nan, 1.0_wp, noise, m, stat)
        call refused('nan-temperature', status_bad_option)
        call langevin_kick(body, 1.0_wp, 1.0_wp, -1.0_wp, noise, m, stat)
        call refused('negative-time', status_bad_time)
        call langevin_kick(body, 1.0_wp, 1.0_wp, nan, noise, m, stat)
        call refused('nan-time', status_bad_time)
        call langevin_kick(body, 1.0_wp, 1.0_wp, 1.0_wp, [1.0_wp, nan, 1.0_wp], m, stat)
        call refused('nan-noise', status_bad_momentum)
        all_m = 1.0_wp
        call langevin_kick(body, 1.0_wp, 1.0_wp, 1.0_wp, all_m(:, 1:1), all_m, stat)
        call t%equal('noise-of-another-size-is-refused', stat, status_bad_count)
        call langevin_kick([body, body, body], 1.0_wp, 1.0_wp, 1.0_wp, all_m, all_m, stat)
        call t%equal('another-number-of-bodies-is-refused', stat, status_bad_count)
        all_m(2, 2) = nan
        call langevin_kick(body, 1.0_wp, 1.0_wp, 1.0_wp, 0*all_m(:, 1:1), all_m(:, 2:2), stat)
        call t%equal('nan-momentum-is-refused', stat, status_bad_momentum)

    contains

        subroutine refused(what, code)
            character(*), intent(in) :: what
            integer, intent(in) :: code

            call t%ok(what//'-is-refused-and-m-untouched', stat == code &
                      .and. all(abs(m - [1.8_wp, 0.4_wp, -0.9_wp]) <= 0.0_wp))
        end subroutine refused

    end subroutine test_kick_refused

    !> BAOAB of a free body: <m_k^2/(I_k kT)> = 1 at any step, as both flows keep the canonical distribution.
    subroutine test_canonical(t)
        type(tally), intent(inout) :: t
        integer, parameter :: samples_taken = 100000
        real(wp), parameter :: temperature = 0.7_wp
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: m(3), q(4), h, sums(3), squares(3), correlation, error, ratio(3), scaled(3)
        integer :: i, k

        body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        do k = 1, 4
            h = 0.05_wp*4**(k - 1)
            m = 0.0_wp
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            sums = 0.0_wp
            squares = 0.0_wp
            do i = 1, samples_taken + 1000
                call free_flow(body, h/2, m, q)
                call langevin_kick(body, 1.5_wp, temperature, h, [normal(random), normal(random), &
                                                                  normal(random)], m)
                call free_flow(body, h/2, m, q)
                if (i <= 1000) cycle
                scaled = m*m/(body%moments()*temperature)
                sums = sums + scaled
                squares = squares + scaled**2
            end do
            ratio = sums/samples_taken
            ! m_k^2 forgets at the rate 2*friction or faster: that many samples count as one.
            correlation = 1/tanh(1.5_wp*h)
            error = sqrt(maxval(squares/samples_taken - ratio**2)*correlation/samples_taken)
            call t%close_to('baoab-of-a-free-body-is-canonical-at-any-step', ratio, &
                            [1.0_wp, 1.0_wp, 1.0_wp], 4*error)
        end do
    end subroutine test_canonical

    !> A standard normal number (Box and Muller).
    function normal(random) result(x)
        type(stream), intent(inout) :: random
        real(wp) :: x
        real(wp) :: radius

        radius = sqrt(-2*log(random%uniform(0.0_wp, 1.0_wp)))
        x = radius*cos(2*pi*random%uniform(0.0_wp, 1.0_wp))
    end function normal

end module frb_test_frames
