!> Derivatives of a step by the inertia, from the parts that frb_flow_tangent_one and frb_flow_tangent_long
!> store of the step.
!>
!> By alpha, beta, gamma as if they were independent, then a1: d_beta + d_gamma, a2: d_alpha - d_gamma, a3:
!> -d_alpha - d_beta, and dI_k = -a_k^2 da_k. An element A_ij off the diagonal of the inverse tensor is a turn
!> of the axes, which changes A_12 by gamma, A_13 by -beta, A_23 by alpha; the formulas are divided by these
!> factors before they are evaluated, so symmetric bodies are no special case. The momentum follows from the
!> attitude: dm' = m' x dtheta'.
module frb_flow_tangent_inertia
    use frb_flow_tangent_parts, only: step_parts
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    use frb_rotations, only: cross
    implicit none
    private

    public :: inertia_columns, elements_in_axes

    !> Numbers that the derivatives of x and Y by any quantity share.
    type :: phase
        real(wp) :: x, yy, twice, over_d0, xg, yd, ye, dn, over_w, c2a, d2b, shift, sign
    end type phase

contains

    !> (dm', dtheta') by the elements 11, 22, 33 of the inertia and, with 6 columns, 12, 13, 23; in the
    !> principal axes of the body, in the order of the caller.
    pure subroutine inertia_columns(body, f, m, elements, columns)
        type(body_core), intent(in) :: body
        type(step_parts), intent(in) :: f
        real(wp), intent(in) :: m(3)                    !! at the end
        integer, intent(in) :: elements                 !! 3 or 6
        real(wp), intent(out) :: columns(6, elements)
        type(phase) :: it
        real(wp) :: turns(3, 3), signs(3), a(3), cn, half
        integer :: axes(3), i, j, k

        call phase_terms(f%c_is_cn, f%a, f%b, f%g, f%m1, f%m3, f%n2, f%n3, f%s, f%c, f%d, it%x, it%yy, &
                         it%twice, it%over_d0)
        call bounded_integrals(f%c_is_cn, f%s, f%c, f%d, f%dd, it%c2a, it%d2b)
        it%over_w = 1/(1 + f%nu*(f%s*f%s))
        it%shift = f%g*((f%d*f%d)*f%dd)*it%over_w
        it%sign = merge(1.0_wp, -1.0_wp, f%c_is_cn)
        it%dn = merge(f%d, f%c, f%c_is_cn)
        ! By dM and dD, at a shifted time, x changes by xg (dD/dn - dn dM), d dY - Y dd is yd dM + ye dD.
        cn = merge(f%c, f%d, f%c_is_cn)
        half = 0.5_wp*(f%s*f%s)*(f%s*it%over_d0)
        it%xg = (f%g*f%m2)*cn*half
        it%yd = (f%b*f%m3)*(f%c*f%d)*half
        it%ye = -it%sign*(f%b*f%m3)*(cn/it%dn)*half
        axes = [f%o1, f%o2, f%o3]
        signs = [f%s1, 1.0_wp, f%s3]
        a(body%order) = body%a
        call diagonal_turns(f, it, turns)
        do k = 1, 3
            columns(3 + axes, axes(k)) = -(a(axes(k))**2*f%t)*(signs*turns(:, k))
        end do
        if (elements == 6) then
            call off_diagonal_turns(f, it, turns)
            do k = 1, 3
                i = axes(modulo(k, 3) + 1)
                j = axes(modulo(k + 1, 3) + 1)
                ! Elements 12, 13, 23 have the numbers 4, 5, 6 = i + j + 1.
                columns(3 + axes, i + j + 1) = -(a(i)*a(j)*f%t*product(signs)*signs(k))*(signs*turns(:, k))
            end do
        end if
        do k = 1, elements
            columns(1:3, k) = cross(m, columns(4:6, k))
        end do
    end subroutine inertia_columns

    !> dtheta' by a1, a2, a3, over t, in the axes of the form. In the mirror form a and theta change their
    !> signs together.
    pure subroutine diagonal_turns(f, it, turns)
        type(step_parts), intent(in) :: f
        type(phase), intent(in) :: it
        real(wp), intent(out) :: turns(3, 3)
        real(wp) :: x11, x22, x33, y, pt, rt, dy, dn, big(3), dif(3), ex(3), ey(3), psi(3)
        real(wp) :: of_alpha(3), of_beta(3), of_gamma(3)

        x11 = f%m1*f%m1
        x22 = f%m2*f%m2
        x33 = f%m3*f%m3
        y = f%s*f%s
        pt = f%b*x11 + f%a*x22
        rt = f%g*x22 + f%b*x33
        ! By alpha, beta, gamma: M, D; explicit parts of x and Y; psi, the angle about m over |m|.
        dif = [-f%b*x33, f%g*x11 - f%a*x33, f%b*x11]
        if (f%c_is_cn) then
            big = [f%g*x22, f%g*x11, pt]
            ex = -it%over_d0*y*x11*[0.0_wp, f%g, f%b]
        else
            dif = -dif
            big = [rt, f%a*x33, f%a*x22]
            ex = -it%over_d0*y*x33*[f%b, f%a, 0.0_wp]
        end if
        ey = it%yy*ex
        ex = it%x*ex
        ex(2) = ex(2) + f%g*y*f%m3*f%m1*it%over_d0
        ex(3) = ex(3) + f%s*f%n2
        ey(2) = ey(2) + f%s*f%n3
        ey(3) = ey(3) - f%b*y*f%d*f%m1*f%m2*it%over_d0
        psi = -it%over_w*[f%g*rt*(it%c2a + it%d2b), f%b*f%g*(f%dd + it%d2b)*x33, &
                          rt*(f%b*f%dd + (f%a + 2*f%g)*it%c2a + f%g*it%d2b) + f%b*f%g*(f%dd + it%d2b)*x22] &
              - it%shift*big
        ! The terms in `own`, combined with the shift of the time.
        dy = f%delta*y
        dn = it%sign*(f%d*f%d)
        psi = psi + (f%own*it%over_w)*[f%g*(dn*f%b*x33 - rt*dy), -dn*f%g*f%g*(x11 + x33), &
                                       dn*f%b*(f%b*x33 - f%g*x11) - rt*(f%a + 2*f%g)*dy]
        of_alpha = turn_of(f, it, ex(1), ey(1), big(1), dif(1), psi(1))
        of_beta = turn_of(f, it, ex(2), ey(2), big(2), dif(2), psi(2))
        of_gamma = turn_of(f, it, ex(3), ey(3), big(3), dif(3), psi(3))
        turns(:, 1) = of_beta + of_gamma + 2*[f%e1, f%e2, f%e3]
        turns(:, 2) = of_alpha - of_gamma
        turns(:, 3) = -of_alpha - of_beta
    end subroutine diagonal_turns

    !> dtheta' by A_23, A_13, A_12, over t, in the axes of the form.
    pure subroutine off_diagonal_turns(f, it, turns)
        type(step_parts), intent(in) :: f
        type(phase), intent(in) :: it
        real(wp), intent(out) :: turns(3, 3)
        real(wp) :: y, w, m23, m31, m12, ex(3), ey(3), psi, along(3)
        integer :: k

        y = f%s*f%s
        w = 1 + f%nu*y
        m23 = f%m2*f%m3
        m31 = f%m3*f%m1
        m12 = f%m1*f%m2
        if (f%c_is_cn) then
            ex = 2*y*[0.0_wp, f%g*m31, f%b*m12]
        else
            ex = -2*y*[f%b*m23, f%a*m31, 0.0_wp]
        end if
        ey = it%over_d0*(it%yy*ex + [0.0_wp, f%s*(f%s*f%d*f%g*m23 + f%c*f%m1), &
                                     f%b*y*f%d*(f%m2*f%m2 - f%m1*f%m1)])
        ex = it%over_d0*(it%x*ex + [0.0_wp, f%g*y*(f%m1*f%m1 - f%m3*f%m3), &
                                    f%s*(f%c*f%d*f%m1 - f%b*m23*f%s)])
        psi = f%b*f%g*(f%dd + it%d2b)*it%over_w
        turns(:, 1) = -turn_by_axes(f, it, ex(1), ey(1), m23, psi)
        turns(:, 2) = -turn_by_axes(f, it, ex(2), ey(2), m31, psi)
        turns(:, 3) = -turn_by_axes(f, it, ex(3), ey(3), m12, psi)
        along = it%twice*f%s*[f%d, it%yy, -it%x*f%d]
        turns(:, 3) = turns(:, 3) + (f%n2*f%d)*along
        turns(:, 2) = turns(:, 2) + f%n3*along
        k = 1
        turns(:, k) = turns(:, k) + (it%twice*w*f%s*f%c*it%over_d0) &
                      *[it%x*f%d*f%m2 - it%yy*f%m3, f%d*f%m3, f%d*f%m2]
    end subroutine off_diagonal_turns

    !> turn_of for a turn of the axes: P changes by -2 gamma mm, P - R by -2 beta mm, mm a product of two
    !> components of m. No term in `own` is left beside the shift of the time.
    pure function turn_by_axes(f, it, ex, ey, mm, psi) result(theta)
        type(step_parts), intent(in) :: f
        type(phase), intent(in) :: it
        real(wp), intent(in) :: ex, ey, mm, psi
        real(wp) :: theta(3)

        real(wp) :: big

        big = merge(-2*f%g*mm, 2*f%a*mm, f%c_is_cn)
        theta = turn_of(f, it, ex, ey, big, -it%sign*(2*f%b*mm), -2*psi*mm - it%shift*big)
    end function turn_by_axes

    !> m' psi - (2/N) [(-Y, d, 0) d dx + (x, 0, 1) (d dY - Y dd)] + 2 (a - a2) m' X from the explicit parts
    !> ex, ey of the change of x and Y, and the changes `big` of M and `dif` of D.
    pure function turn_of(f, it, ex, ey, big, dif, psi) result(theta)
        type(step_parts), intent(in) :: f
        type(phase), intent(in) :: it
        real(wp), intent(in) :: ex, ey, big, dif, psi
        real(wp) :: theta(3)
        real(wp) :: shift, ax, ay

        shift = 0.5_wp*(f%dd*big + f%own*dif)
        ax = (it%twice*f%d)*(ex + it%xg*(dif/it%dn - it%dn*big))
        ay = it%twice*(f%d*ey + (it%yd*big + it%ye*dif))
        theta = [f%e1*(psi + 2*f%g*shift) + it%yy*ax - it%x*ay, f%e2*psi - f%d*ax, &
                 f%e3*(psi - 2*f%a*shift) - ay]
    end function turn_of

    !> A change of one element of a tensor, seen in principal axes: column k has the elements 11, 22, 33, 12,
    !> 13, 23 of axes^T M axes for the M with element k only, in the same order.
    pure function elements_in_axes(axes) result(change)
        real(wp), intent(in) :: axes(3, 3)
        real(wp) :: change(6, 6)
        integer, parameter :: row(6) = [1, 2, 3, 1, 1, 2], column(6) = [1, 2, 3, 2, 3, 3]
        integer :: i, k

        do k = 1, 6
            do i = 1, 6
                change(i, k) = axes(row(k), row(i))*axes(column(k), column(i))
                if (k > 3) change(i, k) = change(i, k) + axes(column(k), row(i))*axes(row(k), column(i))
            end do
        end do
    end function elements_in_axes

    include 'tangent_phase_formulas.inc'

end module frb_flow_tangent_inertia
