!> Rotations, inertia, status: the modules that all others use.
module frb_test_base
    use frb_checks, only: tally
    use frb_inertia, only: principal_axes, sorting_order
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use frb_rotations, only: cross, norm3, quat_product, quat_conjugate, quat_rotate, quat_to_matrix, &
        matrix_to_quat
    use frb_status, only: status_bad_moments, status_bad_tensor
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
    implicit none
    private

    public :: test_base

    real(wp), parameter :: eps = epsilon(1.0_wp)

contains

    subroutine test_base(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: q(4) = [0.8_wp, -0.4_wp, 0.2_wp, 0.4_wp]
        real(wp), parameter :: p(4) = [-0.1_wp, 0.7_wp, 0.5_wp, 0.5_wp]
        real(wp), parameter :: v(3) = [0.3_wp, -1.1_wp, 2.0_wp]
        real(wp), parameter :: identity(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                         0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
        real(wp) :: a(3, 3), moments(3), axes(3, 3), tensor(3, 3), nan, inf
        type(rigid_body) :: body
        integer :: stat, i, order(3)
        real(wp) :: parity
        logical :: signs(4)

        nan = ieee_value(1.0_wp, ieee_quiet_nan)
        inf = ieee_value(1.0_wp, ieee_positive_inf)
        call t%open_suite('base', 20)
        a = quat_to_matrix(q)
        call t%close_to('matrix-of-unit-quaternion-is-orthogonal', &
                        reshape(matmul(transpose(a), a), [9]), reshape(identity, [9]), 2*eps)
        call t%close_to('matrix-and-quaternion-rotate-alike', matmul(a, v), quat_rotate(q, v), 8*eps)
        call t%close_to('product-of-quaternions-is-product-of-matrices', &
                        reshape(quat_to_matrix(quat_product(q, p)), [9]), &
                        reshape(matmul(a, quat_to_matrix(p)), [9]), 8*eps)
        call t%close_to('quaternion-times-conjugate-is-one', quat_product(q, quat_conjugate(q)), &
                        [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 2*eps)
        call t%close_to('matrix-to-quaternion-inverts-quaternion-to-matrix', matrix_to_quat(a), q, 2*eps)
        do i = 1, 4
            signs(i) = all(abs(matrix_to_quat(quat_to_matrix(turn(i))) - turn(i)) <= 4*eps)
        end do
        call t%ok('matrix-to-quaternion-is-sharp-whichever-component-is-largest', all(signs))
        call t%close_to('i-times-j-is-k', quat_product([0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp], &
                                                       [0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp]), &
                        [0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp)
        call t%close_to('cross-product-of-first-two-axes-is-the-third', &
                        cross([1.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 1.0_wp, 0.0_wp]), &
                        [0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp)
        call t%close_to('norm-survives-huge-vectors', norm3([3.0e200_wp, 4.0e200_wp, 0.0_wp])/5.0e200_wp, &
                        1.0_wp, 2*eps)
        call t%close_to('norm-survives-tiny-vectors', norm3([3.0e-200_wp, 4.0e-200_wp, 0.0_wp])/5.0e-200_wp, &
                        1.0_wp, 2*eps)

        call sorting_order([3.0_wp, 1.0_wp, 2.0_wp], order, parity)
        call t%ok('sorting-order-of-a-cycle', all(order == [2, 3, 1]) .and. parity > 0.0_wp)
        call sorting_order([2.0_wp, 1.0_wp, 3.0_wp], order, parity)
        call t%ok('sorting-order-of-a-swap-is-odd', all(order == [2, 1, 3]) .and. parity < 0.0_wp)

        do i = 1, 3
            moments = [1.0_wp, 2.0_wp, 3.0_wp]
            moments(i) = merge(0.0_wp, merge(nan, inf, i == 2), i == 1)
            body = rigid_body(moments)
            call t%equal('zero-nan-or-infinite-moment-is-refused', body%status(), status_bad_moments)
        end do

        tensor = matmul(a, matmul(reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, &
                                           0.0_wp, 0.0_wp, 2.5_wp], [3, 3]), transpose(a)))
        tensor = (tensor + transpose(tensor))/2
        call principal_axes(tensor, moments, axes, stat)
        call t%close_to('principal-moments-of-a-turned-tensor', moments, [1.0_wp, 2.0_wp, 2.5_wp], 8*eps)
        do i = 1, 3
            a(:, i) = moments(i)*axes(:, i)
        end do
        call t%close_to('tensor-is-rebuilt-from-its-axes', reshape(matmul(a, transpose(axes)), [9]), &
                        reshape(tensor, [9]), 16*eps)
        call t%close_to('principal-axes-are-right-handed', cross(axes(:, 1), axes(:, 2)), axes(:, 3), 4*eps)
        tensor(1, 2) = tensor(1, 2) + 0.1_wp
        call principal_axes(tensor, moments, axes, stat)
        call t%equal('unsymmetric-tensor-is-refused', stat, status_bad_tensor)
        body = rigid_body(-identity)
        call t%equal('indefinite-tensor-is-refused', body%status(), status_bad_tensor)
        call t%close_suite()
    end subroutine test_base

    !> A rotation by almost pi about axis i - 1 (about no axis for i = 1), scalar part positive.
    pure function turn(i) result(q)
        integer, intent(in) :: i
        real(wp) :: q(4)

        q = 0.1_wp
        q(i) = 1.0_wp
        q = q/sqrt(sum(q**2))
    end function turn

end module frb_test_base
