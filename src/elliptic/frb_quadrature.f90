!> Gauss-Legendre quadrature, and the integral of the third kind by it (the semi-exact step).
module frb_quadrature
    use frb_complements, only: modulus_complement, one_minus
    use frb_kinds, only: wp, most_points
    use frb_lapack, only: dstev
    use frb_status, only: return_or_stop, status_ok, status_bad_count, status_lapack_failed
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan, ieee_positive_inf
    use, intrinsic :: iso_fortran_env, only: int32
    implicit none
    private

    public :: gauss_legendre, eint_gauss

    !> Up to this many points nodes and weights come from a table.
    integer, parameter :: most_tabulated = 10

    !> The nodes x >= 0 of the rules with 1, 2, .. 10 points, descending within each rule, and their weights
    !> 2/((1 - x**2) P'(x)**2), from 40-digit arithmetic. The rule with p points starts after the first
    !> `before(p)` numbers. The nodes are the roots of the Legendre polynomial P of degree p.
    integer, parameter :: before(most_tabulated) = [0, 1, 2, 4, 6, 9, 12, 16, 20, 25]
    real(wp), parameter :: tabulated_nodes(30) = [ &
        0.0_wp, 0.577350269189625764509_wp, 0.774596669241483377036_wp, &
        0.0_wp, 0.861136311594052575224_wp, 0.339981043584856264803_wp, &
        0.906179845938663992798_wp, 0.538469310105683091036_wp, 0.0_wp, &
        0.932469514203152027812_wp, 0.661209386466264513661_wp, 0.238619186083196908631_wp, &
        0.949107912342758524526_wp, 0.741531185599394439864_wp, 0.405845151377397166907_wp, &
        0.0_wp, 0.960289856497536231684_wp, 0.796666477413626739592_wp, &
        0.525532409916328985818_wp, 0.183434642495649804939_wp, 0.968160239507626089836_wp, &
        0.836031107326635794299_wp, 0.613371432700590397309_wp, 0.324253423403808929039_wp, &
        0.0_wp, 0.973906528517171720078_wp, 0.865063366688984510732_wp, &
        0.679409568299024406234_wp, 0.433395394129247190799_wp, 0.148874338981631210885_wp]
    real(wp), parameter :: tabulated_weights(30) = [ &
        2.00000000000000000000_wp, 1.00000000000000000000_wp, 0.555555555555555555556_wp, &
        0.888888888888888888889_wp, 0.347854845137453857373_wp, 0.652145154862546142627_wp, &
        0.236926885056189087514_wp, 0.478628670499366468041_wp, 0.568888888888888888889_wp, &
        0.171324492379170345040_wp, 0.360761573048138607570_wp, 0.467913934572691047390_wp, &
        0.129484966168869693271_wp, 0.279705391489276667901_wp, 0.381830050505118944950_wp, &
        0.417959183673469387755_wp, 0.101228536290376259153_wp, 0.222381034453374470544_wp, &
        0.313706645877887287338_wp, 0.362683783378361982965_wp, 0.0812743883615744119719_wp, &
        0.180648160694857404058_wp, 0.260610696402935462319_wp, 0.312347077040002840069_wp, &
        0.330239355001259763165_wp, 0.0666713443086881375936_wp, 0.149451349150580593146_wp, &
        0.219086362515982043996_wp, 0.269266719309996355091_wp, 0.295524224714752870174_wp]

contains

    !> Nodes and weights of the Gauss-Legendre rule with np points on [-1, 1], nodes ascending:
    !> int_-1^1 f(x) dx = sum of weights(i) f(nodes(i)) for polynomials f of degree up to 2 np - 1.
    !> Rules of up to 10 points come from a table. For more points the nodes are the eigenvalues of the
    !> tridiagonal Jacobi matrix (Golub and Welsch), by LAPACK's `dstev`, after one Newton step; the weights
    !> come from the derivative of the Legendre polynomial.
    !> Errors: status_bad_count for np < 1, np > 1000 or arrays shorter than np, status_lapack_failed; nodes
    !> and weights are then 0. Elements beyond np are 0.
    !> Accuracy: nodes 1 epsilon, absolute; weights 1 epsilon, relative, up to 10 points and 8 epsilon from 11
    !> to 64; checked by quadrature: nodes-agree-with-table, weights-beyond-10-points-agree-with-table.
    subroutine gauss_legendre(np, nodes, weights, stat)
        integer, intent(in) :: np                  !! number of points, 1 to 1000
        real(wp), intent(out) :: nodes(:)          !! nodes on [-1, 1], at least np elements
        real(wp), intent(out) :: weights(:)        !! weights, sum 2, at least np elements
        integer, intent(out), optional :: stat     !! status_ok, status_bad_count, status_lapack_failed
        integer :: code

        call fill_rule(np, nodes, weights, code)
        call return_or_stop(code, 'gauss_legendre', stat)
    end subroutine gauss_legendre

    !> The integral of the third kind in Legendre's form (20),
    !> int_phi1^phi2 dtheta / ((1 - n sin(theta)**2) sqrt(1 - k**2 sin(theta)**2)), by np Gauss points.
    !> Not exact: the error behaves like (phi2 - phi1)**(2 np + 1), so the semi-exact step has order 2 np.
    !> Antisymmetric in phi1, phi2 to rounding, so the step is time-symmetric.
    !> A result beyond the largest number comes back as Infinity.
    !> Domain: phi1, phi2 finite, |k| <= 1 (or 0 <= kc2 <= 1), n sin**2 < 1; outside: NaN.
    !> Errors: status_bad_count for np < 1 or np > 1000 (the value is then NaN), status_lapack_failed.
    !> Source: section 3.3, (20).
    function eint_gauss(phi1, phi2, n, k, np, kc2, nc, stat) result(value)
        real(wp), intent(in) :: phi1, phi2         !! limits of the integral [rad]
        real(wp), intent(in) :: n                  !! characteristic
        real(wp), intent(in) :: k                  !! modulus
        integer, intent(in) :: np                  !! number of points, 1 to 1000
        real(wp), intent(in), optional :: kc2      !! 1 - k**2; k is then not used
        real(wp), intent(in), optional :: nc       !! 1 - n; n is then not used
        integer, intent(out), optional :: stat     !! status_ok, status_bad_count, status_lapack_failed
        real(wp) :: value
        real(wp), allocatable :: nodes(:), weights(:)
        real(wp) :: complement, difference
        integer :: code, first, last
        logical :: valid

        value = ieee_value(1.0_wp, ieee_quiet_nan)
        code = status_ok
        complement = modulus_complement(k, kc2)
        difference = one_minus(n, nc)
        valid = complement >= 0.0_wp .and. all(ieee_is_finite([phi1, phi2, difference]))
        if (np < 1 .or. np > most_points) then
            code = status_bad_count
        else if (np <= most_tabulated) then
            first = before(np) + 1
            last = before(np) + (np + 1)/2
            if (valid) value = gauss_sum(phi1, phi2, complement, difference, np, &
                                         tabulated_nodes(first:last), tabulated_weights(first:last))
        else
            allocate (nodes(np), weights(np))
            call fill_rule(np, nodes, weights, code)
            first = np/2 + 1
            if (valid .and. code == status_ok) then
                ! the nodes >= 0 only, descending
                value = gauss_sum(phi1, phi2, complement, difference, np, nodes(np:first:-1), &
                                  weights(np:first:-1))
            end if
        end if
        call return_or_stop(code, 'eint_gauss', stat)
    end function eint_gauss

    ! ------------------------------------------------------------------------------------------ inner parts

    !> Sum over the nodes +-x of the integrand; a node x = 0 counts once.
    pure function gauss_sum(phi1, phi2, kc2, nc, np, nodes, weights) result(value)
        real(wp), intent(in) :: phi1, phi2, kc2, nc
        integer, intent(in) :: np
        real(wp), intent(in) :: nodes(:), weights(:)   !! the nodes >= 0 of the rule, descending
        real(wp) :: value
        real(wp) :: middle, half
        integer :: i, pairs

        middle = 0.5_wp*phi1 + 0.5_wp*phi2
        half = 0.5_wp*phi2 - 0.5_wp*phi1
        pairs = np/2
        value = 0.0_wp
        do i = 1, pairs
            value = value + weights(i)*(integrand(middle + half*nodes(i), kc2, nc) &
                                        + integrand(middle - half*nodes(i), kc2, nc))
        end do
        if (np > 2*pairs) value = value + weights(pairs + 1)*integrand(middle, kc2, nc)
        if (.not. ieee_is_finite(value)) return
        if (exponent(half) + exponent(value) < maxexponent(1.0_wp)) then
            value = half*value
        else
            value = sign(ieee_value(1.0_wp, ieee_positive_inf), half)
        end if
    end function gauss_sum

    !> 1/(p sqrt(dd)) with p = 1 - n sin**2 and dd = 1 - k**2 sin**2 as sums without cancellation; NaN where
    !> p or dd is not positive.
    pure function integrand(theta, kc2, nc) result(value)
        real(wp), intent(in) :: theta, kc2, nc
        real(wp) :: value
        real(wp) :: ss, cc, p, dd

        ss = sin(theta)**2
        cc = cos(theta)**2
        p = cc + nc*ss
        dd = cc + kc2*ss
        if (min(p, dd) > 0.0_wp) then
            value = 1/(p*sqrt(dd))
        else
            value = ieee_value(1.0_wp, ieee_quiet_nan)
        end if
    end function integrand

    !> Writes the rule into arrays of at least np elements.
    pure subroutine fill_rule(np, nodes, weights, code)
        integer, intent(in) :: np
        real(wp), intent(out) :: nodes(:), weights(:)
        integer, intent(out) :: code
        integer :: i, half

        nodes = 0.0_wp
        weights = 0.0_wp
        code = status_ok
        if (np < 1 .or. np > min(size(nodes), size(weights), most_points)) then
            code = status_bad_count
        else if (np <= most_tabulated) then
            half = (np + 1)/2
            do i = 1, half
                nodes(i) = -tabulated_nodes(before(np) + i)
                nodes(np + 1 - i) = tabulated_nodes(before(np) + i)
                weights(i) = tabulated_weights(before(np) + i)
                weights(np + 1 - i) = weights(i)
            end do
        else
            call fill_by_eigenvalues(np, nodes, weights, code)
        end if
    end subroutine fill_rule

    !> The rule from the eigenvalues of the Jacobi matrix, off-diagonal j/sqrt(4 j**2 - 1).
    pure subroutine fill_by_eigenvalues(np, nodes, weights, code)
        integer, intent(in) :: np
        real(wp), intent(inout) :: nodes(:), weights(:)
        integer, intent(out) :: code
        real(wp), allocatable :: off_diagonal(:), eigenvalues(:)
        real(wp) :: unused_vectors(1, 1), unused_work(1), x, before_last, value, slope
        integer(int32) :: info
        integer :: i

        allocate (off_diagonal(np - 1), eigenvalues(np))
        eigenvalues = 0.0_wp
        do i = 1, np - 1
            off_diagonal(i) = i/sqrt((2*real(i, wp) - 1)*(2*real(i, wp) + 1))
        end do
        call dstev('N', int(np, int32), eigenvalues, off_diagonal, unused_vectors, 1_int32, unused_work, info)
        if (info /= 0) then
            code = status_lapack_failed
            return
        end if
        code = status_ok
        do i = 1, (np + 1)/2
            x = eigenvalues(np + 1 - i)
            call legendre_pair(np, x, value, before_last)
            slope = np*(before_last - x*value)/((1 - x)*(1 + x))
            x = x - value/slope
            if (2*i == np + 1) x = 0.0_wp
            call legendre_pair(np, x, value, before_last)
            slope = np*(before_last - x*value)/((1 - x)*(1 + x))
            nodes(np + 1 - i) = x
            nodes(i) = -x
            ! 2/((1 - x**2) P'**2) at the root itself. The root is value/slope below the rounded x, and the
            ! second line is the logarithmic derivative, which grows like np**2 towards the ends.
            weights(i) = 2/((1 - x)*(1 + x)*slope*slope)
            weights(i) = weights(i) + weights(i)*2*x*(value/slope)/((1 - x)*(1 + x))
            weights(np + 1 - i) = weights(i)
        end do
    end subroutine fill_by_eigenvalues

    !> Legendre polynomials of degree np and np - 1 at x >= 0. The recurrence is carried by the differences,
    !> j (P_j - P_(j-1)) = (j-1) (P_(j-1) - P_(j-2)) - (2j-1) (1-x) P_(j-1). Rounding in the usual recurrence
    !> acts like an error in x, which near x = 1 grows by np**2.
    pure subroutine legendre_pair(np, x, value, before_last)
        integer, intent(in) :: np
        real(wp), intent(in) :: x
        real(wp), intent(out) :: value, before_last
        real(wp) :: difference
        integer :: j

        before_last = 1.0_wp
        difference = x - 1
        value = x
        do j = 2, np
            difference = ((j - 1)*difference - (2*real(j, wp) - 1)*(1 - x)*value)/j
            before_last = value
            value = value + difference
        end do
    end subroutine legendre_pair

end module frb_quadrature
