!> 1 - k**2 and 1 - n for all elliptic integrals and functions: formed from k and n, or given by the caller,
!> and checked. Close to k = 1 and n = 1 the result depends on these differences, not on k and n.
module frb_complements
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: modulus_complement, one_minus

contains

    !> 1 - k**2 of a modulus |k| <= 1, or kc2, 0 <= kc2 <= 1; -1 for a number that is outside or not finite.
    pure function modulus_complement(k, kc2) result(complement)
        real(wp), intent(in) :: k                  !! modulus
        real(wp), intent(in), optional :: kc2      !! 1 - k**2; k is then not used
        real(wp) :: complement

        ! Test for finite numbers first: comparing a NaN would raise a floating-point exception.
        complement = -1.0_wp
        if (present(kc2)) then
            if (.not. ieee_is_finite(kc2)) return
            if (kc2 >= 0.0_wp .and. kc2 <= 1.0_wp) complement = kc2
        else
            if (.not. ieee_is_finite(k)) return
            if (abs(k) <= 1.0_wp) complement = (1 - k)*(1 + k)
        end if
    end function modulus_complement

    !> 1 - n of a characteristic n, or nc; finite exactly if the one that is used is finite.
    pure function one_minus(n, nc) result(difference)
        real(wp), intent(in) :: n                  !! characteristic
        real(wp), intent(in), optional :: nc       !! 1 - n; n is then not used
        real(wp) :: difference

        if (present(nc)) then
            difference = nc
        else
            difference = 1 - n
        end if
    end function one_minus

end module frb_complements
