!> Helpers of the suites of the free flow: random motions, their exact states with the inherent sensitivity,
!> calls that do not change their input.
module frb_flow_samples
    use, intrinsic :: iso_fortran_env, only: int64
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp, qp, pi, unit_roundoff
    use frb_quad_truth, only: long_truth
    use frb_reference_cases, only: reference_case
    use frb_rotations, only: norm3, quat_rotate
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan, &
        ieee_positive_inf, ieee_negative_inf
    implicit none
    private

    public :: stream, sample, random_samples, true_case, advanced, made_finite, not_a_number, same_bits, &
        near_separatrix, defect, diagonal, no_turn, no_rotation

    real(wp), parameter :: no_turn(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    real(wp), parameter :: no_rotation(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                        0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

    !> Random numbers by Lehmer's generator with multiplier 48271: the same on every machine.
    type :: stream
        integer(int64) :: state = 903
    contains
        procedure :: uniform
        procedure :: log_uniform
        procedure :: direction
        procedure :: triangle
    end type stream

    !> A motion and a step, for the checks over many of them.
    type :: sample
        real(wp) :: moments(3), m(3), q(4), h
    end type sample

contains

    !> Uniform on (low, high).
    function uniform(self, low, high) result(x)
        class(stream), intent(inout) :: self
        real(wp), intent(in) :: low, high
        real(wp) :: x
        integer(int64) :: high_part

        self%state = mod(48271_int64*self%state, 2147483647_int64)
        high_part = self%state
        self%state = mod(48271_int64*self%state, 2147483647_int64)
        x = low + (high - low)*((real(self%state, wp)/2147483647.0_wp + real(high_part, wp))/2147483647.0_wp)
    end function uniform

    !> 10**x with x uniform on (low, high).
    function log_uniform(self, low, high) result(x)
        class(stream), intent(inout) :: self
        real(wp), intent(in) :: low, high
        real(wp) :: x

        x = 10.0_wp**self%uniform(low, high)
    end function log_uniform

    !> A vector of norm one, uniform over all directions.
    function direction(self) result(v)
        class(stream), intent(inout) :: self
        real(wp) :: v(3)
        real(wp) :: phi, z

        z = self%uniform(-1.0_wp, 1.0_wp)
        phi = self%uniform(-pi, pi)
        v = [sqrt(1 - z*z)*cos(phi), sqrt(1 - z*z)*sin(phi), z]
    end function direction

    !> Moments x <= y <= 1 <= x + y, as every real body has, the largest moment one.
    function triangle(self) result(moments)
        class(stream), intent(inout) :: self
        real(wp) :: moments(3)

        moments(2) = self%uniform(0.5_wp, 1.0_wp)
        moments(1) = self%uniform(1 - moments(2), moments(2))
        moments(3) = 1.0_wp
    end function triangle

    !> Motions of bodies away from any special case, at most one orbit long or so: moments between 0.2 and 1,
    !> |m| between 0.5 and 1.5, |h| < 4, every third one shorter.
    function random_samples(number) result(samples)
        integer, intent(in) :: number
        type(sample) :: samples(number)
        type(stream) :: random
        integer :: i

        do i = 1, size(samples)
            associate (it => samples(i))
                it%moments = [random%uniform(0.2_wp, 1.0_wp), random%uniform(0.2_wp, 1.0_wp), &
                              random%uniform(0.2_wp, 1.0_wp)]
                it%m = random%uniform(0.5_wp, 1.5_wp)*random%direction()
                it%q = [random%uniform(-1.0_wp, 1.0_wp), random%direction()]
                it%q = it%q/norm2(it%q)
                it%h = random%uniform(-4.0_wp, 4.0_wp)
                if (mod(i, 3) == 0) it%h = 0.1_wp*it%h
            end associate
        end do
    end function random_samples

    !> A momentum of norm about one on the separatrix of ascending moments, to rounding, with m1 then grown by
    !> a relative `distance`.
    function near_separatrix(random, moments, distance) result(m)
        type(stream), intent(inout) :: random
        real(wp), intent(in) :: moments(3), distance
        real(wp) :: m(3)
        real(wp) :: ratio

        ! gamma m1^2 = alpha m3^2
        ratio = sqrt((moments(3) - moments(2))/(moments(2) - moments(1))*(moments(1)/moments(3)))
        m(3) = random%uniform(-0.7_wp, 0.7_wp)/max(ratio, 1.0_wp)
        m(1) = sign(ratio*m(3)*(1 + distance), random%uniform(-1.0_wp, 1.0_wp))
        m(2) = sign(sqrt(max(0.0_wp, 1 - m(1)**2 - m(3)**2)), random%uniform(-1.0_wp, 1.0_wp))
    end function near_separatrix

    !> The exact motion after h from the identity, by Taylor series in quadruple precision (without one
    !> the series does not end: ask `has_quad`), and how much it changes, summed over the seven
    !> inputs, when one of them grows by a relative 2^-53.
    pure function true_case(moments, m0, h) result(item)
        real(wp), intent(in) :: moments(3), m0(3), h
        type(reference_case) :: item
        real(qp) :: inputs(7), m(3), q(4)
        integer :: i

        item%group = 'taylor'
        item%moments = moments
        item%m0 = m0
        item%h = h
        item%m = real(m0, qp)
        item%q = real(no_turn, qp)
        call long_truth(real(moments, qp), real(h, qp), item%m, item%q)
        do i = 1, 7
            inputs = real([moments, m0, h], qp)
            if (.not. abs(inputs(i)) > 0.0_qp) cycle
            inputs(i) = inputs(i)*(1 + real(unit_roundoff, qp))
            m = inputs(4:6)
            q = real(no_turn, qp)
            call long_truth(inputs(1:3), inputs(7), m, q, rough=.true.)
            item%sens_m = item%sens_m + real(norm2(m - item%m), wp)
            item%sens_q = item%sens_q + real(2*min(norm2(q - item%q), norm2(q + item%q)), wp)
        end do
    end function true_case

    !> m and q after h from m0 and the attitude q0 (the identity when absent), one after another.
    function advanced(moments, m0, h, q0) result(state)
        real(wp), intent(in) :: moments(3), m0(3), h
        real(wp), intent(in), optional :: q0(4)
        real(wp) :: state(7)
        real(wp) :: m(3), q(4)

        m = m0
        q = no_turn
        if (present(q0)) q = q0
        call free_flow(rigid_body(moments), h, m, q)
        state = made_finite([m, q])
    end function advanced

    !> The numbers, or 1e30 for all of them when one is not finite: max and maxval may ignore a NaN.
    pure function made_finite(numbers) result(finite)
        real(wp), intent(in) :: numbers(:)
        real(wp) :: finite(size(numbers))

        finite = 1.0e30_wp
        if (all(ieee_is_finite(numbers))) finite = numbers
    end function made_finite

    !> NaN, Inf or -Inf, without an exception.
    pure function not_a_number(i) result(x)
        integer, intent(in) :: i
        real(wp) :: x

        select case (mod(i, 3))
        case (0)
            x = ieee_value(1.0_wp, ieee_quiet_nan)
        case (1)
            x = ieee_value(1.0_wp, ieee_positive_inf)
        case default
            x = ieee_value(1.0_wp, ieee_negative_inf)
        end select
    end function not_a_number

    !> Equal to the last bit, NaN and signs of zeros included.
    pure function same_bits(x, y) result(equal)
        real(wp), intent(in) :: x(:), y(:)
        logical :: equal

        equal = size(x) == size(y)
        if (equal) equal = all(transfer(x, [0_int64]) == transfer(y, [0_int64]))
    end function same_bits

    !> Distance of a state (m, q) from the orbit of (m0, identity): error of the norm of q, relative errors of
    !> the norm of m, the energy, and the momentum in space. All numbers finite and far from overflow.
    pure function defect(moments, m0, state) result(worst)
        real(wp), intent(in) :: moments(3), m0(3), state(7)
        real(wp) :: worst(4)
        real(wp) :: norm, scaled(3), scaled0(3), energy0

        norm = norm3(m0)
        scaled = state(1:3)/norm
        scaled0 = m0/norm
        energy0 = sum(scaled0**2*(minval(moments)/moments))
        worst(1) = abs(norm2(state(4:7)) - 1)
        worst(2) = abs(norm3(scaled) - norm3(scaled0))
        worst(3) = abs(sum((scaled - scaled0)*(scaled + scaled0)*(minval(moments)/moments)))/energy0
        worst(4) = norm3(quat_rotate(state(4:7)/norm2(state(4:7)), scaled) - scaled0)
    end function defect

    !> The diagonal matrix of three values.
    pure function diagonal(values) result(matrix)
        real(wp), intent(in) :: values(3)
        real(wp) :: matrix(3, 3)

        matrix = 0.0_wp
        matrix(1, 1) = values(1)
        matrix(2, 2) = values(2)
        matrix(3, 3) = values(3)
    end function diagonal

end module frb_flow_samples
