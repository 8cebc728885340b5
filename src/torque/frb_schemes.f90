!> Splitting schemes: symmetric compositions of the drift (the free body, coefficients a) and the kick (the
!> torque, coefficients b), named ones and those a user makes from coefficients of their own.
!>
!> `splitting_scheme('srkn14')` gives a named scheme, `splitting_scheme(a, b)` checks and takes a user's own.
!> A palindrome is stored once, up to its centre.
!>
!> | name     | form | kicks | order | needs Nystroem | source |
!> |----------|------|-------|-------|----------------|--------|
!> | strang   | ABA  | 1     | 2     | no             | drift by h/2, kick by h, drift by h/2 |
!> | yoshida4 | ABA  | 3     | 4     | no             | strang composed three times (Forest-Ruth, Yoshida) |
!> | srkn6    | BAB  | 6     | 4     | yes            | Blanes, Moan 2002, SRKN6b |
!> | s6       | ABA  | 6     | 4     | no             | Blanes, Moan 2002, S6 |
!> | srkn11   | BAB  | 11    | 6     | yes            | Blanes, Moan 2002, SRKN11b |
!> | srkn14   | ABA  | 14    | 6     | yes            | Blanes, Moan 2002, SRKN14a: (23), a_4 corrected |
!> | aba864   | ABA  | 7     | 4     | no             | Blanes et al. 2013; (8, 6, 4) for a small torque |
!>
!> Sources: S. Blanes, P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313; S. Blanes et al., Appl. Numer. Math.
!> 68 (2013) 58; H. Yoshida, Phys. Lett. A 150 (1990) 262.
module frb_schemes
    use frb_kinds, only: wp
    use frb_order_conditions, only: order_report, order_conditions
    use frb_status, only: status_ok, status_bad_scheme, status_bad_option
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: splitting_scheme, scheme_names, mirrored, most_stages

    !> No scheme has more drifts or more kicks than this.
    integer, parameter :: most_stages = 64

    !> Names that `splitting_scheme(name)` knows.
    character(8), parameter :: scheme_names(7) = [character(8) :: 'strang', 'yoshida4', 'srkn6', 's6', &
                                                  'srkn11', 'srkn14', 'aba864']

    !> A symmetric splitting scheme. The components are for reading. A scheme that could not be made has
    !> `status /= status_ok`, and `integrate` refuses it with that code.
    type :: splitting_scheme
        integer :: status = status_bad_scheme   !! `status_ok`, or why the scheme could not be made
        character(16) :: name = ''
        logical :: drift_first = .true.         !! ABA: opens and closes with a drift; else BAB, with a kick
        integer :: drifts = 0                   !! drift coefficients of one step
        integer :: kicks = 0                    !! kick coefficients of one step
        real(wp) :: half_a(most_stages/2) = 0.0_wp  !! drift coefficients up to the centre
        real(wp) :: half_b(most_stages/2) = 0.0_wp  !! kick coefficients up to the centre
    contains
        procedure :: drift_coefficients
        procedure :: kick_coefficients
        procedure :: stages
        procedure :: conditions
    end type splitting_scheme

    interface splitting_scheme
        module procedure scheme_by_name
        module procedure scheme_from_coefficients
    end interface splitting_scheme

contains

    !> The scheme with one of the names in `scheme_names`; `status_bad_option` for any other.
    pure function scheme_by_name(name) result(scheme)
        character(*), intent(in) :: name
        type(splitting_scheme) :: scheme
        real(wp), parameter :: outer = 1/(2 - 2.0_wp**(1/3.0_wp))

        select case (name)
        case ('strang')
            scheme = closed([real(wp) ::], [real(wp) ::], drift_first=.true.)
        case ('yoshida4')
            scheme = closed([outer/2], [outer], drift_first=.true.)
        case ('srkn6')
            scheme = closed([0.245298957184271_wp, 0.604872665711080_wp], &
                            [0.0829844064174052_wp, 0.396309801498368_wp, -0.0390563049223486_wp], &
                            drift_first=.false.)
        case ('s6')
            scheme = closed([0.0792036964311957_wp, 0.353172906049774_wp, -0.0420650803577195_wp], &
                            [0.209515106613362_wp, -0.143851773179818_wp], drift_first=.true.)
        case ('srkn11')
            scheme = closed([0.123229775946271_wp, 0.290553797799558_wp, -0.127049212625417_wp, &
                             -0.246331761062075_wp, 0.357208872795928_wp], &
                            [0.0414649985182624_wp, 0.198128671918067_wp, -0.0400061921041533_wp, &
                             0.0752539843015807_wp, -0.0115113874206879_wp], drift_first=.false.)
        case ('srkn14')
            scheme = closed([0.0378593198406116_wp, 0.102635633102435_wp, -0.0258678882665587_wp, &
                             0.314241403071447_wp, -0.130144459517415_wp, 0.106417700369543_wp, &
                             -0.00879424312851058_wp], &
                            [0.09171915262446165_wp, 0.183983170005006_wp, -0.05653436583288827_wp, &
                             0.004914688774712854_wp, 0.143761127168358_wp, 0.328567693746804_wp], &
                            drift_first=.true.)
        case ('aba864')
            scheme = closed([0.0711334264982231177779387300061549964174_wp, &
                             0.241153427956640098736487795326289649618_wp, &
                             0.521411761772814789212136078067994229991_wp], &
                            [0.183083687472197221961703757166430291072_wp, &
                             0.310782859898574869507522291054262796375_wp, &
                             -0.0265646185119588006972121379164987592663_wp], drift_first=.true.)
        case default
            scheme%status = status_bad_option
        end select
        scheme%name = name
    end function scheme_by_name

    !> A scheme from all coefficients of one step, in the order of use: one more drift than kicks (ABA) or one
    !> more kick than drifts (BAB). `mirrored` writes out a palindrome given up to its centre.
    !> `status_bad_scheme` unless the coefficients are at most 1e6 in size, symmetric to 1e-14 of the largest
    !> (or of one) and sum to one within `tolerance`, with at most `most_stages` drifts and kicks. What order
    !> they have, `conditions` tells.
    pure function scheme_from_coefficients(a, b, name, tolerance) result(scheme)
        real(wp), intent(in) :: a(:)                    !! drifts
        real(wp), intent(in) :: b(:)                    !! kicks
        character(*), intent(in), optional :: name
        real(wp), intent(in), optional :: tolerance     !! how far from one a sum may be, default 1e-12
        type(splitting_scheme) :: scheme
        real(wp) :: inconsistency

        scheme%name = 'own'
        if (present(name)) scheme%name = name
        if (abs(size(a) - size(b)) /= 1 .or. min(size(a), size(b)) < 1) return
        if (max(size(a), size(b)) > most_stages) return
        inconsistency = 1.0e-12_wp
        if (present(tolerance)) inconsistency = tolerance
        if (.not. (consistent(a, inconsistency) .and. consistent(b, inconsistency))) return
        scheme%status = status_ok
        scheme%drift_first = size(a) > size(b)
        scheme%drifts = size(a)
        scheme%kicks = size(b)
        scheme%half_a(1:(size(a) + 1)/2) = a(1:(size(a) + 1)/2)
        scheme%half_b(1:(size(b) + 1)/2) = b(1:(size(b) + 1)/2)
    end function scheme_from_coefficients

    !> Whether coefficients are finite, symmetric and sum to one.
    pure function consistent(c, inconsistency) result(good)
        real(wp), intent(in) :: c(:)
        real(wp), intent(in) :: inconsistency
        logical :: good
        real(wp), parameter :: asymmetry = 1.0e-14_wp, largest_coefficient = 1.0e6_wp
        real(wp) :: largest

        good = all(ieee_is_finite(c))
        if (.not. good) return
        largest = maxval(abs(c))
        good = largest <= largest_coefficient
        if (good) good = all(abs(c - c(size(c):1:-1)) <= asymmetry*max(largest, 1.0_wp)) &
                         .and. abs(sum(c) - 1) <= inconsistency
    end function consistent

    !> A scheme whose last coefficient of each kind up to the centre follows from the sum being one: one at
    !> the centre counts once, one beside it twice.
    pure function closed(a, b, drift_first) result(scheme)
        real(wp), intent(in) :: a(:), b(:)      ! up to the centre without the last
        logical, intent(in) :: drift_first
        type(splitting_scheme) :: scheme
        logical :: centre_is_inner, centre_is_drift

        ! Outer coefficients are one more than inner ones: as many up to the centre means the centre is an
        ! inner one.
        centre_is_inner = size(a) == size(b)
        centre_is_drift = centre_is_inner .neqv. drift_first
        scheme%status = status_ok
        scheme%drift_first = drift_first
        scheme%drifts = 2*size(a) + merge(1, 2, centre_is_drift)
        scheme%kicks = 2*size(b) + merge(2, 1, centre_is_drift)
        scheme%half_a(1:size(a)) = a
        scheme%half_b(1:size(b)) = b
        scheme%half_a(size(a) + 1) = merge(1 - 2*sum(a), 0.5_wp - sum(a), centre_is_drift)
        scheme%half_b(size(b) + 1) = merge(0.5_wp - sum(b), 1 - 2*sum(b), centre_is_drift)
    end function closed

    !> All drift coefficients of one step, in the order of use; none for a scheme that could not be made.
    pure function drift_coefficients(self) result(a)
        class(splitting_scheme), intent(in) :: self
        real(wp) :: a(self%drifts)

        if (self%status == status_ok) a = mirrored(self%half_a, self%drifts)
    end function drift_coefficients

    !> All kick coefficients of one step, in the order of use; none for a scheme that could not be made.
    pure function kick_coefficients(self) result(b)
        class(splitting_scheme), intent(in) :: self
        real(wp) :: b(self%kicks)

        if (self%status == status_ok) b = mirrored(self%half_b, self%kicks)
    end function kick_coefficients

    !> Torque evaluations per step in a chain of steps, where a kick that closes a step and the one that opens
    !> the next are one.
    pure function stages(self) result(count)
        class(splitting_scheme), intent(in) :: self
        integer :: count

        count = min(self%drifts, self%kicks)
    end function stages

    !> What the order conditions say about the scheme: its order, its order under the Nystroem condition (the
    !> one that counts for a body under torque), its orders for a small torque, and the residuals. A condition
    !> counts as met within `tolerance`, 1e-12 by default. Takes about a millisecond.
    pure function conditions(self, tolerance) result(report)
        class(splitting_scheme), intent(in) :: self
        real(wp), intent(in), optional :: tolerance
        type(order_report) :: report

        if (self%status == status_ok) then
            report = order_conditions(self%drift_coefficients(), self%kick_coefficients(), self%drift_first, &
                                      tolerance)
        end if
    end function conditions

    !> The palindrome of `count` coefficients whose first half, the centre included, is `half`.
    pure function mirrored(half, count) result(full)
        real(wp), intent(in) :: half(:)     !! size at least (count + 1)/2
        integer, intent(in) :: count
        real(wp) :: full(count)
        integer :: i

        full = [(half(min(i, count + 1 - i)), i=1, count)]
    end function mirrored

end module frb_schemes
