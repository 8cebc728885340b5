!> Errors against the truth in quadruple precision, absolute and in units of the inherent sensitivity.
module frb_chart_truth
    use frb, only: wp
    use frb_chart_methods, only: method, advance, family_matrix, family_paper_a
    use frb_taylor_truth, only: qp, long_truth
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: free_case, new_case, add_sensitivity, errors_of, distance_m, distance_q

    !> A body, its start at the identity attitude, and its exact state at time t.
    type :: free_case
        real(wp) :: moments(3) = 1.0_wp
        real(wp) :: m0(3) = 0.0_wp
        real(wp) :: t = 0.0_wp
        real(qp) :: m(3) = 0.0_qp
        real(qp) :: q(4) = 0.0_qp
        real(wp) :: unit_m = 1.0_wp     !! 2^-53 |m| + change of m(t) when each input moves by 2^-53
        real(wp) :: unit_q = 1.0_wp     !! the same for the attitude, as an angle
    end type free_case

    real(wp), parameter :: roundoff = epsilon(1.0_wp)/2
    real(qp), parameter :: identity(4) = [1.0_qp, 0.0_qp, 0.0_qp, 0.0_qp]

contains

    !> The case with its truth.
    pure function new_case(moments, m0, t) result(item)
        real(wp), intent(in) :: moments(3), m0(3), t
        type(free_case) :: item

        item%moments = moments
        item%m0 = m0
        item%t = t
        item%m = real(m0, qp)
        item%q = identity
        call long_truth(real(moments, qp), real(t, qp), item%m, item%q)
    end function new_case

    !> Sets the units of the case: the sum over the seven inputs (I, m, t) of the change of the result when
    !> that input alone grows by a relative 2^-53, plus 2^-53 of the result.
    pure subroutine add_sensitivity(item)
        type(free_case), intent(inout) :: item
        real(qp) :: inputs(7), m(3), q(4)
        integer :: i

        item%unit_m = roundoff*real(norm2(item%m), wp)
        item%unit_q = 2*roundoff
        do i = 1, 7
            inputs = real([item%moments, item%m0, item%t], qp)
            if (.not. abs(inputs(i)) > 0.0_qp) cycle
            inputs(i) = inputs(i)*(1 + real(roundoff, qp))
            m = inputs(4:6)
            q = identity
            call long_truth(inputs(1:3), inputs(7), m, q, rough=.true.)
            item%unit_m = item%unit_m + real(norm2(m - item%m), wp)
            item%unit_q = item%unit_q + real(2*min(norm2(q - item%q), norm2(q + item%q)), wp)
        end do
    end subroutine add_sensitivity

    !> Errors of a method that takes nsteps equal steps to the time of the case: |m - m_ref|, and the
    !> attitude's as an angle [rad] (for a matrix, Frobenius norm over root two). NaN when it fails.
    subroutine errors_of(with, item, nsteps, error_m, error_q)
        type(method), intent(in) :: with
        type(free_case), intent(in) :: item
        integer, intent(in) :: nsteps
        real(wp), intent(out) :: error_m, error_q
        real(wp) :: m(3), q(4), a(3, 3)

        m = item%m0
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call advance(with, item%moments, item%t/nsteps, nsteps, m, q, a)
        error_m = distance_m(item, m)
        if (with%family == family_matrix .or. with%family == family_paper_a) then
            error_q = real(norm2(reshape(a - matrix_of(item%q), [9]))/sqrt(2.0_qp), wp)
        else
            error_q = distance_q(item, q)
        end if
        if (.not. all(ieee_is_finite([error_m, error_q]))) then
            error_m = huge(1.0_wp)
            error_q = huge(1.0_wp)
        end if
    end subroutine errors_of

    !> |m - m_ref|.
    pure function distance_m(item, m) result(distance)
        type(free_case), intent(in) :: item
        real(wp), intent(in) :: m(3)
        real(wp) :: distance

        distance = real(norm2(m - item%m), wp)
    end function distance_m

    !> The angle between the attitudes [rad], for small ones: 2 |q -+ q_ref|.
    pure function distance_q(item, q) result(distance)
        type(free_case), intent(in) :: item
        real(wp), intent(in) :: q(4)
        real(wp) :: distance

        distance = real(2*min(norm2(q - item%q), norm2(q + item%q)), wp)
    end function distance_q

    !> Rotation matrix of a quaternion of norm one, in quadruple precision.
    pure function matrix_of(q) result(matrix)
        real(qp), intent(in) :: q(4)
        real(qp) :: matrix(3, 3)

        matrix = reshape([1 - 2*(q(3)**2 + q(4)**2), 2*(q(2)*q(3) + q(1)*q(4)), 2*(q(2)*q(4) - q(1)*q(3)), &
                          2*(q(2)*q(3) - q(1)*q(4)), 1 - 2*(q(2)**2 + q(4)**2), 2*(q(3)*q(4) + q(1)*q(2)), &
                          2*(q(2)*q(4) + q(1)*q(3)), 2*(q(3)*q(4) - q(1)*q(2)), 1 - 2*(q(2)**2 + q(3)**2)], &
                          [3, 3])
    end function matrix_of

end module frb_chart_truth
