!> Vectors, quaternions and rotation matrices: the algebra of section 1.4, all pure.
!>
!> Conventions of the whole library. Quaternions are real(4), scalar first, with the
!> Hamilton product. An attitude, as a quaternion q or a matrix Q, takes body to space: v_space = Q v_body.
!> Angular momentum m and angular velocity omega = m/I are in the body frame: q' = q (0, omega)/2,
!> Q' = Q hat(omega), and Q m is constant.
module frb_rotations
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
    implicit none
    private

    public :: cross, norm3, quat_product, quat_conjugate, quat_rotate, quat_to_matrix, matrix_to_quat, &
        quat_along, is_unit_quat, unit_tolerance

    !> A quaternion whose norm must be one may miss one by this much.
    real(wp), parameter :: unit_tolerance = 1.0e-6_wp

contains

    !> Vector product u x v.
    pure function cross(u, v) result(w)
        real(wp), intent(in) :: u(3), v(3)
        real(wp) :: w(3)

        w = [u(2)*v(3) - u(3)*v(2), u(3)*v(1) - u(1)*v(3), u(1)*v(2) - u(2)*v(1)]
    end function cross

    !> Euclidean norm without overflow or underflow, for any finite v.
    pure function norm3(v) result(norm)
        real(wp), intent(in) :: v(3)
        real(wp) :: norm
        real(wp) :: largest

        largest = maxval(abs(v))
        if (largest > 1.0e-140_wp .and. largest < 1.0e140_wp) then
            norm = sqrt(v(1)*v(1) + v(2)*v(2) + v(3)*v(3))
        else if (largest > 0.0_wp) then
            norm = largest*sqrt(sum((v/largest)**2))
        else
            norm = largest
        end if
    end function norm3

    !> Hamilton product p q. The product of q and its conjugate has a vector part of exactly zero, in fused
    !> arithmetic too: parentheses keep a compiler from fusing a product with a sum, which would round equal
    !> products of opposite sign differently.
    pure function quat_product(p, q) result(pq)
        real(wp), intent(in) :: p(4), q(4)
        real(wp) :: pq(4)

        pq(1) = (p(1)*q(1)) - (p(2)*q(2)) - (p(3)*q(3)) - (p(4)*q(4))
        pq(2) = (p(1)*q(2)) + (q(1)*p(2)) + (p(3)*q(4)) - (p(4)*q(3))
        pq(3) = (p(1)*q(3)) + (q(1)*p(3)) + (p(4)*q(2)) - (p(2)*q(4))
        pq(4) = (p(1)*q(4)) + (q(1)*p(4)) + (p(2)*q(3)) - (p(3)*q(2))
    end function quat_product

    !> Conjugate of q; for a unit quaternion its inverse.
    pure function quat_conjugate(q) result(conjugate)
        real(wp), intent(in) :: q(4)
        real(wp) :: conjugate(4)

        conjugate = [q(1), -q(2), -q(3), -q(4)]
    end function quat_conjugate

    !> Whether q is a unit quaternion: finite, | |q| - 1 | at most 1e-6. Every routine of the library that
    !> needs a unit quaternion calls this function and refuses other quaternions, with `status_bad_attitude`
    !> or with NaN. Routines that take any norm say so.
    pure function is_unit_quat(q) result(good)
        real(wp), intent(in) :: q(4)
        logical :: good
        real(wp) :: largest, square

        good = ieee_is_finite(q(1)) .and. ieee_is_finite(q(2)) .and. ieee_is_finite(q(3)) &
               .and. ieee_is_finite(q(4))
        if (.not. good) return
        largest = max(abs(q(1)), abs(q(2)), abs(q(3)), abs(q(4)))
        good = largest < 2.0_wp
        if (.not. good) return
        square = (q(1)*q(1) + q(2)*q(2)) + (q(3)*q(3) + q(4)*q(4))
        good = square >= (1 - unit_tolerance)**2 .and. square <= (1 + unit_tolerance)**2
    end function is_unit_quat

    !> The vector E(q) v, from body to space for an attitude q of norm one, (10); NaN for another norm.
    pure function quat_rotate(q, v) result(w)
        real(wp), intent(in) :: q(4), v(3)
        real(wp) :: w(3)
        real(wp) :: twice_cross(3)

        twice_cross = 2*cross(q(2:4), v)
        w = v + q(1)*twice_cross + cross(q(2:4), twice_cross)
        if (.not. is_unit_quat(q)) w = ieee_value(w, ieee_quiet_nan)
    end function quat_rotate

    !> Rotation matrix E(q) of a quaternion of norm one, (10); NaN for another norm.
    pure function quat_to_matrix(q) result(matrix)
        real(wp), intent(in) :: q(4)
        real(wp) :: matrix(3, 3)

        matrix(1, 1) = 1 - 2*(q(3)*q(3) + q(4)*q(4))
        matrix(2, 1) = 2*(q(2)*q(3) + q(1)*q(4))
        matrix(3, 1) = 2*(q(2)*q(4) - q(1)*q(3))
        matrix(1, 2) = 2*(q(2)*q(3) - q(1)*q(4))
        matrix(2, 2) = 1 - 2*(q(2)*q(2) + q(4)*q(4))
        matrix(3, 2) = 2*(q(3)*q(4) + q(1)*q(2))
        matrix(1, 3) = 2*(q(2)*q(4) + q(1)*q(3))
        matrix(2, 3) = 2*(q(3)*q(4) - q(1)*q(2))
        matrix(3, 3) = 1 - 2*(q(2)*q(2) + q(3)*q(3))
        if (.not. is_unit_quat(q)) matrix = ieee_value(matrix, ieee_quiet_nan)
    end function quat_to_matrix

    !> Unit quaternion of a rotation matrix, up to sign; the scalar part comes back non-negative. NaN for a
    !> matrix whose elements are more than 1e-6 from those of a rotation, such as a reflection.
    pure function matrix_to_quat(matrix) result(q)
        real(wp), intent(in) :: matrix(3, 3)
        real(wp) :: q(4)
        real(wp), parameter :: tolerance = 1.0e-6_wp, largest_element = 2.0_wp

        ! Large elements are refused before the product is formed: their squares may overflow.
        if (all(ieee_is_finite(matrix))) then
            if (all(abs(matrix) < largest_element)) then
                q = quat_along(matrix)
                if (maxval(abs(q)) > 0.0_wp) then
                    q = q/sqrt(sum(q**2))
                    if (q(1) < 0.0_wp) q = -q
                    if (all(abs(quat_to_matrix(q) - matrix) <= tolerance)) return
                end if
            end if
        end if
        q = ieee_value(1.0_wp, ieee_quiet_nan)
    end function matrix_to_quat

    !> A quaternion of a rotation matrix, of any sign and of a norm from 1 to 4. Its largest component, or one
    !> nearly as large, is formed as a sum that does not cancel: no digits are lost at any attitude.
    pure function quat_along(matrix) result(q)
        real(wp), intent(in) :: matrix(3, 3)
        real(wp) :: q(4)
        real(wp) :: trace

        trace = matrix(1, 1) + matrix(2, 2) + matrix(3, 3)
        if (trace >= 0.0_wp) then
            q(1) = 1 + trace
            q(2) = matrix(3, 2) - matrix(2, 3)
            q(3) = matrix(1, 3) - matrix(3, 1)
            q(4) = matrix(2, 1) - matrix(1, 2)
        else if (matrix(1, 1) >= max(matrix(2, 2), matrix(3, 3))) then
            q = [matrix(3, 2) - matrix(2, 3), 1 + matrix(1, 1) - matrix(2, 2) - matrix(3, 3), &
                 matrix(1, 2) + matrix(2, 1), matrix(1, 3) + matrix(3, 1)]
        else if (matrix(2, 2) >= matrix(3, 3)) then
            q = [matrix(1, 3) - matrix(3, 1), matrix(1, 2) + matrix(2, 1), &
                 1 + matrix(2, 2) - matrix(3, 3) - matrix(1, 1), matrix(2, 3) + matrix(3, 2)]
        else
            q = [matrix(2, 1) - matrix(1, 2), matrix(1, 3) + matrix(3, 1), matrix(2, 3) + matrix(3, 2), &
                 1 + matrix(3, 3) - matrix(1, 1) - matrix(2, 2)]
        end if
    end function quat_along

end module frb_rotations
