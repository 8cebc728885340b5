!> Reads reference cases of the derivatives of a step (data/reference) and scores results against them, in
!> units of their inherent sensitivity: 1 is the error caused by rounding the input to double precision.
module frb_tangent_cases
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp, qp, unit_roundoff
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: tangent_case, read_tangent_cases, read_tensor_cases, score_matrix, hat

    !> Kept to 22 digits where the compiler can: double precision would add half a unit to a score.
    type :: tangent_case
        character(20) :: group = ''
        type(rigid_body) :: body
        real(wp) :: moments(3) = 0.0_wp     !! of a body by moments
        real(wp) :: m0(3) = 0.0_wp
        real(wp) :: h = 0.0_wp
        real(qp) :: jacobian(3, 3) = 0.0_qp, turns(3, 3) = 0.0_qp               !! J, W
        real(qp) :: by_inertia(6, 6) = 0.0_qp       !! of (m', theta') by 3 moments or 6 elements
        real(wp) :: sensitivity(4) = 0.0_wp         !! of J, W, dm', dtheta'
    end type tangent_case

contains

    !> All cases of a file of bodies by moments, in its order; stops when the file cannot be read.
    subroutine read_tangent_cases(path, cases)
        character(*), intent(in) :: path
        type(tangent_case), allocatable, intent(out) :: cases(:)
        real(qp) :: state(7), matrices(3, 3, 4)
        type(tangent_case) :: item
        integer :: unit, io, count, pass

        do pass = 1, 2
            open (newunit=unit, file=path, status='old', action='read')
            count = 0
            do
                read (unit, *, iostat=io) item%group, item%moments, item%m0, item%h, state, matrices, &
                    item%sensitivity
                if (io /= 0) exit
                count = count + 1
                if (pass == 1) cycle
                item%body = rigid_body(item%moments)
                item%jacobian = transpose(matrices(:, :, 1))
                item%turns = transpose(matrices(:, :, 2))
                item%by_inertia(1:3, 1:3) = transpose(matrices(:, :, 3))
                item%by_inertia(4:6, 1:3) = transpose(matrices(:, :, 4))
                cases(count) = item
            end do
            close (unit)
            if (pass == 1) allocate (cases(count))
        end do
    end subroutine read_tangent_cases

    !> All cases of a file of bodies by a tensor.
    subroutine read_tensor_cases(path, cases)
        character(*), intent(in) :: path
        type(tangent_case), allocatable, intent(out) :: cases(:)
        real(wp) :: e(6)
        real(qp) :: state(7), jacobian(3, 3), turns(3, 3), columns(6, 3, 2)
        type(tangent_case) :: item
        integer :: unit, io, count, pass

        do pass = 1, 2
            open (newunit=unit, file=path, status='old', action='read')
            count = 0
            do
                read (unit, *, iostat=io) item%group, e, item%m0, item%h, state, jacobian, turns, columns, &
                    item%sensitivity
                if (io /= 0) exit
                count = count + 1
                if (pass == 1) cycle
                item%body = rigid_body(reshape([e(1), e(4), e(5), e(4), e(2), e(6), e(5), e(6), e(3)], [3, &
                                                                                                        3]))
                item%jacobian = transpose(jacobian)
                item%turns = transpose(turns)
                item%by_inertia(1:3, :) = transpose(columns(:, :, 1))
                item%by_inertia(4:6, :) = transpose(columns(:, :, 2))
                cases(count) = item
            end do
            close (unit)
            if (pass == 1) allocate (cases(count))
        end do
    end subroutine read_tensor_cases

    !> |x - exact| in units of 2^-53 |exact| + sensitivity, Frobenius norms; 1e30 when x is not finite.
    pure function score_matrix(x, exact, sensitivity) result(score)
        real(wp), intent(in) :: x(:, :)
        real(qp), intent(in) :: exact(:, :)
        real(wp), intent(in) :: sensitivity
        real(wp) :: score
        real(qp) :: unit

        score = 1.0e30_wp
        if (.not. all(ieee_is_finite(x))) return
        unit = unit_roundoff*norm2(exact) + sensitivity
        score = 0.0_wp
        if (norm2(x - exact) > 0.0_qp) score = real(min(norm2(x - exact)/max(unit, tiny(1.0_qp)), &
                                                        1.0e30_qp), wp)
    end function score_matrix

    !> Matrix of the vector product with v.
    pure function hat(v) result(x)
        real(wp), intent(in) :: v(3)
        real(wp) :: x(3, 3)

        x = reshape([0.0_wp, v(3), -v(2), -v(3), 0.0_wp, v(1), v(2), -v(1), 0.0_wp], [3, 3])
    end function hat

end module frb_tangent_cases
