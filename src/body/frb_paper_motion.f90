!> The problem of one step in the form of the paper: sorted moments, momentum of norm one (section 3.1), the
!> constants of section 1.2, and the motions that need no elliptic function.
!>
!> With the moments J1 <= J2 <= J3 in ascending order and time in units of J1/|m|, the angular velocity is
!> (m1, a2 m2, a3 m3) and
!>
!>     m1' = -alpha m2 m3,      m2' = beta m3 m1,      m3' = -gamma m1 m2,      beta = alpha + gamma.
!>
!> The paper's constants, as sums of terms of one sign where such a form exists:
!>
!>     p = 2T - 1/I3 = beta m1**2 + alpha m2**2        r = 1/I1 - 2T = gamma m2**2 + beta m3**2
!>     delta = 1/I2 - 2T = alpha m3**2 - gamma m1**2   lambda3**2 = gamma p,  lambda1**2 = alpha r,
!>
!> delta < 0 is case (i), delta > 0 case (ii), delta = 0 the separatrix (iii), and
!> 1 - k**2 = beta abs(delta)/lambda**2.
module frb_paper_motion
    use frb_inertia, only: sorting_order
    use frb_kinds, only: wp, most_points
    use frb_rotations, only: quat_product
    use frb_status, only: status_ok, status_bad_attitude, status_bad_count, status_bad_moments, &
        status_bad_momentum, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: paper_motion, normal_form, attitude_code, simple_motion, add_momentum, turn_from_one
    public :: motion_at_rest, motion_sphere, motion_axis, motion_equal_12, motion_equal_23, motion_elliptic

    integer, parameter :: motion_at_rest = 0    !! m = 0
    integer, parameter :: motion_sphere = 1     !! three equal moments
    integer, parameter :: motion_axis = 2       !! rotation about a principal axis, m constant
    integer, parameter :: motion_equal_12 = 3   !! I1 = I2: m turns about axis 3
    integer, parameter :: motion_equal_23 = 4   !! I2 = I3: m turns about axis 1
    integer, parameter :: motion_elliptic = 5   !! the three cases of section 1.2

    !> No element of an attitude may be larger: a turn of the attitude could overflow.
    real(wp), parameter :: largest_attitude = 1.0e300_wp

    !> A unit momentum closer than this to a principal axis counts as on the axis, so that no square
    !> underflows.
    real(wp), parameter :: on_axis = 1.0e-130_wp

    !> A motion with 1 - k**2 below this counts as on the separatrix, so that nothing underflows.
    real(wp), parameter :: on_separatrix = 1.0e-270_wp

    !> A body with alpha below this counts as one with I2 = I3, so that nothing underflows. Such I2 and I3 are
    !> far larger than I1: by a factor of 1e90, or of 1e74 if they differ in their last digit only.
    real(wp), parameter :: smallest_alpha = 1.0e-90_wp

    !> One step in the paper's form; made by `normal_form`.
    type :: paper_motion
        integer :: kind = motion_at_rest
        integer :: order(3) = [1, 2, 3]     !! sorted component i is the caller's component order(i)
        logical :: sorted = .true.          !! order is 1, 2, 3
        real(wp) :: parity = 1.0_wp         !! -1 for an odd permutation: a reflection, so m changes its sign
        real(wp) :: norm = 0.0_wp           !! |m| of the caller times 2**(-shift)
        integer :: shift = 0                !! not 0 only for momenta of extreme size
        real(wp) :: time = 0.0_wp           !! the step h |m|/J1
        real(wp) :: m(3) = 0.0_wp           !! sorted momentum of norm one
        real(wp) :: a2 = 1.0_wp, a3 = 1.0_wp    !! J1/J2, J1/J3
        real(wp) :: alpha = 0.0_wp, beta = 0.0_wp, gamma = 0.0_wp
        real(wp) :: p = 0.0_wp, r = 0.0_wp
        logical :: first_case = .true.      !! case (i), or (iii): k is lambda1/lambda3
        real(wp) :: lambda = 0.0_wp         !! lambda3 in case (i), lambda1 in case (ii)
        real(wp) :: kc2 = 1.0_wp            !! 1 - k**2, 0 for case (iii)
        real(wp) :: nc = 1.0_wp             !! 1 - n, n as in (9): abs(delta)/p or abs(delta)/r
    end type paper_motion

contains

    !> Checks a step's moments, momentum and time, and brings them to the form of the paper.
    pure subroutine normal_form(h, moments, momentum, motion, code)
        real(wp), intent(in) :: h                   !! step, any finite number
        real(wp), intent(in) :: moments(3)          !! moments of inertia, any order
        real(wp), intent(in) :: momentum(3)         !! body angular momentum, any norm
        type(paper_motion), intent(out) :: motion
        integer, intent(out) :: code                !! `status_ok`, or what is wrong
        real(wp) :: j1, j2, j3, largest, scaled(3), excess

        ! Test for finite numbers first: comparing a NaN would raise a floating-point exception.
        code = status_bad_moments
        if (.not. all(ieee_is_finite(moments))) return
        if (min(moments(1), moments(2), moments(3)) < tiny(1.0_wp)) return
        code = status_bad_momentum
        if (.not. all(ieee_is_finite(momentum))) return
        code = status_bad_time
        if (.not. ieee_is_finite(h)) return
        code = status_ok

        scaled = momentum
        if (moments(1) <= moments(2) .and. moments(2) <= moments(3)) then
            j1 = moments(1)
            j2 = moments(2)
            j3 = moments(3)
        else
            call sorting_order(moments, motion%order, motion%parity)
            motion%sorted = .false.
            j1 = moments(motion%order(1))
            j2 = moments(motion%order(2))
            j3 = moments(motion%order(3))
            scaled = motion%parity*momentum(motion%order)
        end if
        largest = max(abs(scaled(1)), abs(scaled(2)), abs(scaled(3)))
        if (largest <= 0.0_wp) return
        if (largest < 1.0e-100_wp .or. largest > 1.0e100_wp) then
            motion%shift = exponent(largest)
            scaled = scale(scaled, -motion%shift)
        end if
        motion%norm = sqrt(scaled(1)*scaled(1) + scaled(2)*scaled(2) + scaled(3)*scaled(3))
        scaled = scaled/motion%norm
        ! The norm's rounding error is the same in every step of a chain: it would add up.
        excess = scaled(1)*scaled(1) + scaled(2)*scaled(2) + scaled(3)*scaled(3) - 1
        motion%m = scaled - (0.5_wp*excess)*scaled
        motion%time = scaled_time(h, motion%norm, j1, motion%shift)

        motion%a2 = j1/j2
        motion%a3 = j1/j3
        motion%alpha = ((j3 - j2)/j3)*motion%a2
        motion%beta = (j3 - j1)/j3
        motion%gamma = (j2 - j1)/j2
        if (motion%alpha < smallest_alpha) motion%alpha = 0.0_wp
        if (motion%beta <= 0.0_wp) then
            motion%kind = motion_sphere
        else if (motion%gamma <= 0.0_wp) then
            motion%kind = motion_equal_12
        else if (motion%alpha <= 0.0_wp) then
            motion%kind = motion_equal_23
        else if (is_on_axis(motion%m)) then
            motion%kind = motion_axis
        else
            motion%kind = motion_elliptic
            call set_constants(motion)
        end if
    end subroutine normal_form

    !> `status_ok`, or what is wrong with the attitude or the number of Gauss points of a step.
    pure function attitude_code(elements, attitude, zero_allowed, points) result(code)
        integer, intent(in) :: elements             !! 9 for a matrix, 4 for a quaternion
        real(wp), intent(in) :: attitude(elements)
        logical, intent(in) :: zero_allowed
        integer, intent(in) :: points
        integer :: code
        real(wp) :: largest

        code = status_bad_attitude
        if (.not. all(ieee_is_finite(attitude))) return
        largest = maxval(abs(attitude))
        if (largest > largest_attitude .or. (largest <= 0.0_wp .and. .not. zero_allowed)) return
        code = status_bad_count
        if (points >= 0 .and. points <= most_points) code = status_ok
    end function attitude_code

    !> Constants of the elliptic motion, (3).
    pure subroutine set_constants(motion)
        type(paper_motion), intent(inout) :: motion
        real(wp) :: m1m1, m2m2, m3m3, delta_by_alpha

        m1m1 = motion%m(1)*motion%m(1)
        m2m2 = motion%m(2)*motion%m(2)
        m3m3 = motion%m(3)*motion%m(3)
        motion%p = motion%beta*m1m1 + motion%alpha*m2m2
        motion%r = motion%gamma*m2m2 + motion%beta*m3m3
        delta_by_alpha = m3m3 - (motion%gamma/motion%alpha)*m1m1    ! alpha m3**2 could underflow
        motion%first_case = delta_by_alpha <= 0.0_wp
        if (motion%first_case) then
            motion%lambda = sqrt(motion%gamma*motion%p)
            motion%nc = -delta_by_alpha/(motion%p/motion%alpha)
            motion%kc2 = motion%beta*(motion%nc/motion%gamma)
        else
            motion%lambda = sqrt(motion%alpha*motion%r)
            motion%nc = motion%alpha*(delta_by_alpha/motion%r)
            motion%kc2 = motion%beta*(delta_by_alpha/motion%r)
        end if
        motion%kc2 = min(motion%kc2, 1.0_wp)
        if (motion%kc2 < on_separatrix) then
            motion%kc2 = 0.0_wp
            motion%nc = 0.0_wp
        end if
    end subroutine set_constants

    !> Change of the momentum and turn of the body for the motions without elliptic functions (line (3) of
    !> the algorithms): rest, sphere, rotation about an axis, two equal moments.
    pure subroutine simple_motion(motion, change, q)
        type(paper_motion), intent(in) :: motion    !! of any kind but `motion_elliptic`
        real(wp), intent(out) :: change(3)          !! m(h) - m(0), sorted, for norm one
        real(wp), intent(out) :: q(4)               !! attitude at h from the identity, sorted axes
        real(wp) :: sine, cosine, spin(4)

        change = 0.0_wp
        select case (motion%kind)
        case (motion_at_rest)
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        case (motion_sphere)
            q = turn_about(motion%m, motion%time)
        case (motion_equal_12)
            ! m turns about axis 3 by beta m3 t; the other factor is a turn about m by t/I1.
            sine = sin(0.5_wp*(motion%beta*motion%m(3)*motion%time))
            cosine = cos(0.5_wp*(motion%beta*motion%m(3)*motion%time))
            change(1) = -2*sine*(motion%m(1)*sine + motion%m(2)*cosine)
            change(2) = 2*sine*(motion%m(1)*cosine - motion%m(2)*sine)
            spin = [cosine, 0.0_wp, 0.0_wp, -sine]
            q = quat_product(turn_about(motion%m, motion%time), spin)
        case (motion_equal_23)
            sine = sin(0.5_wp*(motion%beta*motion%m(1)*motion%time))
            cosine = cos(0.5_wp*(motion%beta*motion%m(1)*motion%time))
            change(2) = 2*sine*(motion%m(3)*cosine - motion%m(2)*sine)
            change(3) = -2*sine*(motion%m(3)*sine + motion%m(2)*cosine)
            spin = [cosine, sine, 0.0_wp, 0.0_wp]
            q = quat_product(turn_about(motion%m, motion%a3*motion%time), spin)
        case default
            ! m and the angular velocity are parallel: the angle is 2T t.
            q = turn_about(motion%m, (motion%m(1)**2 + motion%a2*motion%m(2)**2 &
                                      + motion%a3*motion%m(3)**2)*motion%time)
        end select
    end subroutine simple_motion

    !> The caller's momentum at the end, from a change of the sorted unit momentum. It is formed as old value
    !> plus change: the rounding error of a small step is that of a small number.
    pure function add_momentum(motion, momentum, change) result(new)
        type(paper_motion), intent(in) :: motion
        real(wp), intent(in) :: momentum(3)     !! at the start, in the caller's order
        real(wp), intent(in) :: change(3)       !! sorted, for norm one
        real(wp) :: new(3)
        real(wp) :: difference(3), limit
        integer :: i

        difference = motion%norm*change
        if (motion%shift /= 0) then
            ! Halves: the result may be close to the largest number, and their sum does not overflow.
            do i = 1, 3
                new(motion%order(i)) = scale(0.5_wp*momentum(motion%order(i)), -motion%shift) &
                    + 0.5_wp*motion%parity*difference(i)
            end do
            limit = scale(huge(1.0_wp), -max(motion%shift, 0) - 1)
            new = scale(max(min(new, limit), -limit), motion%shift + 1)
        else if (motion%sorted) then
            new = momentum + difference
        else
            do i = 1, 3
                new(motion%order(i)) = momentum(motion%order(i)) + motion%parity*difference(i)
            end do
        end if
    end function add_momentum

    !> The turn of a body as a change of its attitude, in the caller's axes: turn = sense (1 + change). The
    !> scalar part of the change comes from the vector part v, q0 - 1 = -|v|**2/(1 + q0): the norm of
    !> 1 + change is then one to the rounding error of the change, and an attitude advanced as old value plus
    !> change keeps its norm in a long chain of steps.
    pure subroutine turn_from_one(motion, turn, change, sense)
        type(paper_motion), intent(in) :: motion
        real(wp), intent(in) :: turn(4)         !! a quaternion of norm one to rounding, sorted axes
        real(wp), intent(out) :: change(4)
        real(wp), intent(out) :: sense          !! -1 or +1, the sign of the scalar part

        sense = sign(1.0_wp, turn(1))
        change(1) = -(turn(2)*turn(2) + turn(3)*turn(3) + turn(4)*turn(4))/(1 + abs(turn(1)))
        if (motion%sorted) then
            change(2:4) = sense*turn(2:4)
        else
            change(1 + motion%order) = (sense*motion%parity)*turn(2:4)
        end if
    end subroutine turn_from_one

    !> Quaternion of a turn by an angle about a unit vector.
    pure function turn_about(axis, angle) result(q)
        real(wp), intent(in) :: axis(3), angle
        real(wp) :: q(4)
        real(wp) :: sine

        sine = sin(0.5_wp*angle)
        q = [cos(0.5_wp*angle), sine*axis(1), sine*axis(2), sine*axis(3)]
    end function turn_about

    !> Whether at least two components vanish, to `on_axis`.
    pure function is_on_axis(m) result(yes)
        real(wp), intent(in) :: m(3)
        logical :: yes

        yes = max(min(abs(m(1)), abs(m(2))), min(abs(m(1)), abs(m(3))), min(abs(m(2)), abs(m(3)))) < on_axis
    end function is_on_axis

    !> h norm 2**shift/j1 without overflow on the way, and at most 2**1000: such a phase has no correct digit.
    pure function scaled_time(h, norm, j1, shift) result(time)
        real(wp), intent(in) :: h, norm, j1
        integer, intent(in) :: shift
        real(wp) :: time
        integer :: power

        if (shift == 0 .and. max(abs(h), j1) < 1.0e100_wp .and. j1 > 1.0e-100_wp) then
            time = h*(norm/j1)
        else
            power = exponent(h) + exponent(norm) - exponent(j1) + shift
            time = scale(fraction(h)*fraction(norm)/fraction(j1), max(min(power, 1000), -1000))
        end if
    end function scaled_time

end module frb_paper_motion
