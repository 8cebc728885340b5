!> Carlson's duplications and the series that end them, for arguments of moderate size: the parts of RF, RC
!> and RJ of `frb_carlson`.
!>
!> One duplication replaces each argument v by (v + lambda)/4, lambda = sqrt(x y) + sqrt(x z) + sqrt(y z): the
!> differences of the arguments become four times smaller. When they are small, a Taylor series about the mean
!> gives the integral. It is longer than usual (degree 11 for RF, 9 for RJ), because one more duplication
!> costs more than a dozen terms.
!>
!> Source: B. C. Carlson, Numerical computation of real or complex elliptic integrals, Numer. Algorithms 10
!> (1995) 13-26; DLMF 19.19.7 (the series) and 19.36.
module frb_duplication
    use frb_kinds, only: wp
    implicit none
    private

    public :: rf_by_duplication, rj_by_duplication, rc_regular, rc_series

    !> Largest relative distance from the mean at which the series are good to a quarter of an ulp.
    real(wp), parameter :: rf_radius = 0.055_wp
    real(wp), parameter :: rj_radius = 0.020_wp

    !> Bound of loops that would not end for NaN where a compiler assumes that there is no NaN (-Ofast).
    integer, parameter :: most_duplications = 4096

contains

    !> RF(x, y, z) of arguments >= 0, at most one of them zero.
    pure function rf_by_duplication(x, y, z) result(value)
        real(wp), intent(in) :: x, y, z
        real(wp) :: value
        real(wp) :: xn, yn, zn

        xn = x
        yn = y
        zn = z
        call rf_duplications(xn, yn, zn)
        value = rf_series(xn, yn, zn)
    end function rf_by_duplication

    !> RJ(x, y, z, p) and, if present, RF(x, y, z): RF does not change in the duplications of RJ.
    pure subroutine rj_by_duplication(x, y, z, p, third, first)
        real(wp), intent(in) :: x, y, z, p              !! x, y, z >= 0, at most one of them zero; p > 0
        real(wp), intent(out) :: third                  !! RJ(x, y, z, p)
        real(wp), intent(out), optional :: first        !! RF(x, y, z)
        real(wp) :: xn, yn, zn, pn, total, quarter

        xn = x
        yn = y
        zn = z
        pn = p
        call rj_duplications(xn, yn, zn, pn, total, quarter)
        third = total + quarter*rj_series(xn, yn, zn, pn)
        if (present(first)) first = rf_series(xn, yn, zn)
    end subroutine rj_by_duplication

    !> Duplications until x, y, z are within `rf_radius` of their mean.
    pure subroutine rf_duplications(x, y, z)
        real(wp), intent(inout) :: x, y, z
        real(wp) :: sx, sy, sz, lambda, mean, distance
        integer :: n

        mean = (x + y + z)/3
        distance = max(abs(mean - x), abs(mean - y), abs(mean - z))/rf_radius
        do n = 1, most_duplications
            if (distance <= mean) exit
            sx = sqrt(x)
            sy = sqrt(y)
            sz = sqrt(z)
            lambda = sx*(sy + sz) + sy*sz
            x = 0.25_wp*(x + lambda)
            y = 0.25_wp*(y + lambda)
            z = 0.25_wp*(z + lambda)
            mean = 0.25_wp*(mean + lambda)
            distance = 0.25_wp*distance
        end do
    end subroutine rf_duplications

    !> RF by its series about the mean, to degree 11 in the relative distances (DLMF 19.19.7). The distances
    !> are formed from the last arguments: then their absolute error is an ulp, and e2, e3 multiply this error
    !> by a distance.
    pure function rf_series(x, y, z) result(value)
        real(wp), intent(in) :: x, y, z
        real(wp) :: value
        real(wp) :: mean, inverse, dx, dy, dz, e2, e3

        mean = (x + y + z)*(1.0_wp/3)
        inverse = 1/mean
        dx = (mean - x)*inverse
        dy = (mean - y)*inverse
        dz = -(dx + dy)
        e2 = dx*dy - dz*dz
        e3 = dx*dy*dz
        value = (e2*(-1.0_wp/10 + e2*(1.0_wp/24 + e2*(-5.0_wp/208 + e2*(35.0_wp/2176 - e2*(3.0_wp/256))))) &
                 + e3*(1.0_wp/14 + e2*(-3.0_wp/44 + e2*(1.0_wp/16 + e2*(-35.0_wp/608 + e2*(315.0_wp/5888)))) &
                       + e3*(3.0_wp/104 + e2*(-15.0_wp/272 + e2*(5.0_wp/64)) &
                             + e3*(5.0_wp/304 - e2*(35.0_wp/736)))))
        value = (1 + value)/sqrt(mean)
    end function rf_series

    !> RC for x >= 0, y > 0.
    pure function rc_regular(x, y) result(value)
        real(wp), intent(in) :: x, y
        real(wp) :: value
        real(wp) :: root, sx, sy

        if (abs(y - x) <= 0.1_wp*x) then
            value = rc_series((y - x)/x)/sqrt(x)
        else if (y > x) then
            root = sqrt(y - x)
            value = atan2(root, sqrt(x))/root
        else
            root = sqrt(x - y)
            sx = sqrt(x)
            sy = sqrt(y)
            if (sx > 1.0e150_wp*sy) then
                value = (log(2*sx) - log(sy))/root   ! both logarithms count with the same sign
            else
                value = log((sx + root)/sy)/root
            end if
        end if
    end function rc_regular

    !> RC(1, 1 + e) = 1 - e/3 + e**2/5 - ... for |e| <= 0.1.
    pure function rc_series(e) result(value)
        real(wp), intent(in) :: e
        real(wp) :: value
        real(wp) :: e2, e4

        e2 = e*e
        if (e2 <= 1.0e-6_wp) then
            value = 1 - e*(1.0_wp/3 - e*(1.0_wp/5 - e*(1.0_wp/7 - e*(1.0_wp/9 - e*(1.0_wp/11)))))
        else
            e4 = e2*e2
            value = 1 - e*((1.0_wp/3 - e*(1.0_wp/5)) + e2*(1.0_wp/7 - e*(1.0_wp/9)) &
                           + e4*((1.0_wp/11 - e*(1.0_wp/13)) + e2*(1.0_wp/15 - e*(1.0_wp/17)) &
                           + e4*((1.0_wp/19 - e*(1.0_wp/21)) + e2*(1.0_wp/23 - e*(1.0_wp/25)) &
                           + e4*((1.0_wp/27 - e*(1.0_wp/29)) + e2*(1.0_wp/31)))))
        end if
    end function rc_series

    !> Duplications until x, y, z, p are within `rj_radius` of their mean. With the new arguments
    !> RJ(old) = total + quarter RJ(x, y, z, p) and RF(old) = RF(x, y, z), where quarter = 4**-steps and
    !> total = sum of 6 4**-n/d_n RC(1, 1 + e_n), e_n = delta/(64**n d_n**2), (Carlson 1995, section 2.3).
    pure subroutine rj_duplications(x, y, z, p, total, quarter)
        real(wp), intent(inout) :: x, y, z, p
        real(wp), intent(out) :: total, quarter
        real(wp) :: sx, sy, sz, sp, lambda, mean, distance, d, inverse, delta, e
        integer :: n

        total = 0.0_wp
        quarter = 1.0_wp
        mean = 0.2_wp*(x + y + z + 2*p)
        distance = max(abs(mean - x), abs(mean - y), abs(mean - z), abs(mean - p))/rj_radius
        delta = (p - x)*(p - y)*(p - z)
        do n = 1, most_duplications
            if (distance <= mean) exit
            sx = sqrt(x)
            sy = sqrt(y)
            sz = sqrt(z)
            sp = sqrt(p)
            lambda = sx*(sy + sz) + sy*sz
            d = (sp + sx)*((sp + sy)*(sp + sz))
            inverse = 1/d
            e = delta*inverse*inverse
            if (abs(e) <= 0.1_wp) then
                total = total + 6*quarter*inverse*rc_series(e)
            else
                ! 1 + e = 2 sp (p + lambda)/d without the cancellation of 1 + e as p tends to 0
                total = total + 6*quarter*inverse*rc_regular(1.0_wp, 2*sp*(p + lambda)*inverse)
            end if
            x = 0.25_wp*(x + lambda)
            y = 0.25_wp*(y + lambda)
            z = 0.25_wp*(z + lambda)
            p = 0.25_wp*(p + lambda)
            mean = 0.25_wp*(mean + lambda)
            distance = 0.25_wp*distance
            quarter = 0.25_wp*quarter
            delta = delta*(1.0_wp/64)
        end do
    end subroutine rj_duplications

    !> RJ by its series about the mean, to degree 9 in the relative distances (DLMF 19.19.7).
    pure function rj_series(x, y, z, p) result(value)
        real(wp), intent(in) :: x, y, z, p
        real(wp) :: value
        real(wp) :: mean, inverse, dx, dy, dz, dp, xyz, pp, e2, e3, e4, e5

        mean = 0.2_wp*(x + y + z + 2*p)
        inverse = 1/mean
        dx = (mean - x)*inverse
        dy = (mean - y)*inverse
        dz = (mean - z)*inverse
        dp = -0.5_wp*(dx + dy + dz)
        pp = dp*dp
        xyz = dx*dy*dz
        e2 = dx*(dy + dz) + dy*dz - 3*pp
        e3 = xyz + 2*dp*(e2 + 2*pp)
        e4 = dp*(2*xyz + dp*(e2 + 3*pp))
        e5 = xyz*pp
        value = e2*(-3.0_wp/14 + e2*(9.0_wp/88 + e2*(-1.0_wp/16 + e2*(105.0_wp/2432)))) &
            + e3*(1.0_wp/6 + e2*(-9.0_wp/52 + e2*(45.0_wp/272 - e2*(5.0_wp/32))) &
                  + e3*(3.0_wp/40 - e2*(45.0_wp/304) + e3*(5.0_wp/112))) &
            + e4*(-3.0_wp/22 + e2*(3.0_wp/20 - e2*(45.0_wp/304)) + e4*(9.0_wp/152) &
                  + e3*(-9.0_wp/68 + e2*(15.0_wp/56))) &
            + e5*(3.0_wp/26 + e2*(-9.0_wp/68 + e2*(15.0_wp/112)) + e3*(9.0_wp/76) - e4*(3.0_wp/28))
        value = (1 + value)*inverse/sqrt(mean)
    end function rj_series

end module frb_duplication
